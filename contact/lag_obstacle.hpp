// The vertices that an obstacle bears on as friction sees them (lagged_contacts.hpp): each face
// presses with lambda = -K b'(g) along its normal, and its surface point moves with the obstacle.
#pragma once

#include <taut/contact/friction_coefficients.hpp>
#include <taut/contact/lagged_contacts.hpp>
#include <taut/contact/obstacle_kernels.hpp>

namespace taut {

/// What an obstacle does in a whole step: turns about its centre, which goes along a line.
struct ObstacleCarry {
  Mat3<double> turn = identity3<double>();
  Vec3<double> along{0, 0, 0};
  Vec3<double> centre{0, 0, 0};             ///< now, m
  Mat3<double> back = identity3<double>();  ///< from how it is turned now to the start of the step

  /// How far a point of it goes that is at x now, m.
  KOKKOS_INLINE_FUNCTION Vec3<double> operator()(Vec3<double> const& x) const {
    Vec3<double> const w = back * (x - centre);
    return turn * w - w + along;
  }
};

namespace kernels {

/// Item i most + f: face f and surface vertex i.
template <class Table, class Precision, class S>
struct LagFace {
  using Real = typename Precision::real;
  Table table;
  VectorField<typename Precision::position, S> x;
  typename SurfaceViews<S>::Indices object;  ///< per vertex of the mesh
  FrictionMatrix<S> mu;                      ///< of object k: mu(k, k)
  ObstacleCarry carry;

  KOKKOS_FUNCTION bool operator()(int item, LaggedContact<Real>& to) const { return lag(item, to); }
  [[gnu::noinline]] KOKKOS_FUNCTION bool lag(int item, LaggedContact<Real>& to) const {
    constexpr int most = decltype(table.faces)::most;
    int const i = item / most, f = item % most, v = table.vertex(i);
    if (f >= table.faces.count || !table.free(i)) return false;
    double const activation = table.activation(i);
    FaceDistance const at = distance_to(table.faces.face[f], table.from_centre(i, x));
    if (!(at.distance > 0 && at.distance < activation)) return false;
    double const press =
        -table.stiffness(i) * obstacle_barrier(table.barrier, at.distance, activation).slope;
    Vec3<double> const motion = carry({double(x(v, 0)), double(x(v, 1)), double(x(v, 2))});
    to.vertex[0] = v;
    to.c[0] = Real(1);
    to.limit = static_cast<Real>(mu(object(v), object(v)) * press);
    for (int c = 0; c < 3; ++c) {
      to.normal[c] = static_cast<Real>(at.n[c]);
      to.motion[c] = static_cast<Real>(motion[c]);
    }
    return to.limit > Real(0);
  }
};

}  // namespace kernels

}  // namespace taut
