// The kernels of an obstacle: one sweep over the vertices of the surface,
//
//   E = Sum over vertices v and faces f of  K_v b(g_f(x_v)),
//
// with the distance g of obstacle_shapes.hpp. Its derivatives are, with n the gradient of g,
//
//   dE/dx = K b' n,   d2E/dx2 = K (b'' n n^T - b' / r (I - n n^T)),
//
// where r is the distance from the middle of a sphere; of a cylinder the second term acts across
// its axis only, and a plane has none. As a round face is seen from inside, g is concave; as b
// falls, both terms are positive semi-definite, so the Hessian is taken as it is: there is nothing
// to project and nothing to leave out.
//
// All is in fp64: it is a few operations for each vertex of the surface, and a logarithm for those
// in contact. What does arithmetic is compiled once ([[gnu::noinline]]), see contact_kernels.hpp.
#pragma once

#include <taut/contact/barrier.hpp>
#include <taut/contact/obstacle_path.hpp>
#include <taut/contact/step_bound_sweep.hpp>
#include <taut/contact/stiffness.hpp>
#include <taut/contact/surface.hpp>

namespace taut::kernels {

/// What all sweeps read.
template <int n, class Barrier, class Rule, class Precision, class S>
struct ObstacleTable {
  using Position = typename Precision::position;
  using Real = typename Precision::real;
  using Positions = VectorField<Position, S>;
  using Vectors = VectorField<Real, S>;

  typename SurfaceViews<S>::Indices vertex;
  FixedMask<S> held;            ///< per surface vertex: 1 for what is fixed within the obstacle
  Array<double, S> activation;  ///< per surface vertex: the distance below which a face acts, m
  Barrier barrier;
  Rule rule;
  StiffnessFields<Precision, S> fields;
  PlacedFaces<n> faces;

  KOKKOS_FUNCTION bool free(int i) const { return !fields.fixed(vertex(i)); }
  /// Of surface vertex i, from the centre of the obstacle.
  KOKKOS_FUNCTION Vec3<double> from_centre(int i, Positions const& x) const {
    int const v = vertex(i);
    Vec3<double> w;
    for (int c = 0; c < 3; ++c) w[c] = double(x(v, c)) - faces.origin[c];
    return w;
  }
  KOKKOS_FUNCTION Vec3<double> step(int i, Vectors const& p, double alpha) const {
    int const v = vertex(i);
    Vec3<double> s;
    for (int c = 0; c < 3; ++c) s[c] = alpha * double(p(v, c));
    return s;
  }
  KOKKOS_FUNCTION double stiffness(int i) const { return rule.vertex(fields, vertex(i)); }
  KOKKOS_FUNCTION FacePath path(int i, int f, Positions const& x, Vectors const& p,
                                FaceMotion const& motion) const {
    int const v = vertex(i);
    return FacePath(Vec3<Position>{x(v, 0), x(v, 1), x(v, 2)},
                    Vec3<Real>{p(v, 0), p(v, 1), p(v, 2)}, faces.origin, faces.face[f], motion);
  }
};

/// Energies are infinite from the face on, whatever the barrier.
template <class Barrier>
KOKKOS_INLINE_FUNCTION BarrierValues<double> obstacle_barrier(Barrier const& barrier,
                                                              double distance, double activation) {
  constexpr double infinity = Kokkos::Experimental::infinity_v<double>;
  if (!(distance > 0)) return {infinity, -infinity, infinity};
  return evaluate_barrier(barrier, distance, activation);
}

/// E(w + s) - E(w) of one face, over K, without cancellation: distances change by n . s, or by
/// (|w|^2 - |w + s|^2) / (|w| + |w + s|).
template <class Barrier>
KOKKOS_INLINE_FUNCTION double obstacle_change(Barrier const& barrier, ObstacleFace const& face,
                                              Vec3<double> const& w, Vec3<double> const& s,
                                              double activation) {
  FaceDistance const before = distance_to(face, w), after = distance_to(face, w + s);
  if (!(before.distance < activation) && !(after.distance < activation)) return 0;
  if (!(before.distance > 0) || !(after.distance > 0)) {
    return obstacle_barrier(barrier, after.distance, activation).value -
           obstacle_barrier(barrier, before.distance, activation).value;
  }
  double step;
  if (face.kind == FaceKind::plane) {
    step = dot(face.direction, s);
  } else {
    bool const round = face.kind == FaceKind::cylinder;
    Vec3<double> const twice = 2.0 * w + s;
    double const both = before.radius + after.radius;
    double const product =
        round ? dot(cross(face.direction, s), cross(face.direction, twice)) : dot(s, twice);
    step = both > 0 ? -product / both : 0;
  }
  return barrier_change(barrier, before.distance, after.distance, step, activation);
}

/// The Hessian of a face in contact at w, over K.
KOKKOS_INLINE_FUNCTION Sym3<double> obstacle_hessian(ObstacleFace const& face,
                                                     FaceDistance const& at,
                                                     BarrierValues<double> const& b) {
  double const round = at.radius > 0 ? -b.slope / at.radius : 0;
  double const normal = b.curvature - round;  // as n n^T is part of the identity
  bool const axis = face.kind == FaceKind::cylinder;
  Vec3<double> const &n = at.n, &a = face.direction;
  double const along = axis ? -round : 0;
  int const row[6] = {0, 1, 2, 0, 1, 0}, column[6] = {0, 1, 2, 1, 2, 2};
  Sym3<double> h;
  for (int k = 0; k < 6; ++k) {
    int const i = row[k], j = column[k];
    h.s[k] = normal * n[i] * n[j] + along * a[i] * a[j] + (i == j ? round : 0);
  }
  // A diagonal that is nil but for rounding must not be less.
  for (int k = 0; k < 3; ++k) h.s[k] = Kokkos::max(h.s[k], 0.0);
  return h;
}

/// All faces at one vertex.
struct ObstacleForce {
  Vec3<double> gradient{0, 0, 0};
  Sym3<double> hessian{{0, 0, 0, 0, 0, 0}};
  int contacts = 0;
};
template <class Table>
KOKKOS_INLINE_FUNCTION ObstacleForce obstacle_force(Table const& table, int i,
                                                    typename Table::Positions const& x,
                                                    bool with_hessian) {
  ObstacleForce r;
  Vec3<double> const w = table.from_centre(i, x);
  double const activation = table.activation(i);
  for (int f = 0; f < table.faces.count; ++f) {
    FaceDistance const at = distance_to(table.faces.face[f], w);
    if (!(at.distance < activation)) continue;
    auto const b = obstacle_barrier(table.barrier, at.distance, activation);
    r.gradient = r.gradient + b.slope * at.n;
    ++r.contacts;
    if (!with_hessian) continue;
    Sym3<double> const h = obstacle_hessian(table.faces.face[f], at, b);
    for (int k = 0; k < 6; ++k) r.hessian.s[k] += h.s[k];
  }
  if (r.contacts == 0) return r;
  double const stiffness = table.stiffness(i);
  r.gradient = stiffness * r.gradient;
  for (int k = 0; k < 6; ++k) r.hessian.s[k] *= stiffness;
  return r;
}

template <class Table>
struct ObstacleValue {
  Table table;
  typename Table::Positions x;
  [[gnu::noinline]] KOKKOS_FUNCTION double value(int i) const {
    if (!table.free(i)) return 0;
    Vec3<double> const w = table.from_centre(i, x);
    double const activation = table.activation(i);
    double sum = 0;
    for (int f = 0; f < table.faces.count; ++f) {
      double const d = distance_to(table.faces.face[f], w).distance;
      if (d < activation) sum += obstacle_barrier(table.barrier, d, activation).value;
    }
    return sum == 0 ? 0 : table.stiffness(i) * sum;
  }
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sum) const { sum[0] += value(i); }
};

/// By the step alpha p that starts at x; that has led to x if `arrived`.
template <class Table>
struct ObstacleChange {
  Table table;
  typename Table::Positions x;
  typename Table::Vectors p;
  double alpha;
  bool arrived;
  [[gnu::noinline]] KOKKOS_FUNCTION double change(int i) const {
    if (!table.free(i)) return 0;
    Vec3<double> const s = table.step(i, p, alpha);
    Vec3<double> const w = arrived ? table.from_centre(i, x) - s : table.from_centre(i, x);
    double sum = 0;
    for (int f = 0; f < table.faces.count; ++f) {
      sum += obstacle_change(table.barrier, table.faces.face[f], w, s, table.activation(i));
    }
    return sum == 0 ? 0 : table.stiffness(i) * sum;
  }
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sum) const { sum[0] += change(i); }
};

/// Adds gradient and `numbers` of curvature.
template <class Table, int numbers, class CurvatureField>
struct ObstacleGradient {
  using Real = typename Table::Real;
  Table table;
  typename Table::Positions x;
  double scale;
  typename Table::Vectors g;
  CurvatureField curvature;

  [[gnu::noinline]] KOKKOS_FUNCTION void add(int i) const {
    if (!table.free(i)) return;
    ObstacleForce const r = obstacle_force(table, i, x, numbers > 0);
    if (r.contacts == 0) return;
    int const v = table.vertex(i);
    for (int c = 0; c < 3; ++c) g(v, c) += static_cast<Real>(scale * r.gradient[c]);
    if constexpr (numbers > 0) {
      for (int c = 0; c < numbers; ++c) {
        curvature(v, c) += static_cast<Real>(scale * r.hessian.s[c]);
      }
    }
  }
  KOKKOS_FUNCTION void operator()(int i) const { add(i); }
};
/// And E(x) - E(x - alpha p).
template <class Table, int numbers, class CurvatureField>
struct ObstacleGradientAfter {
  ObstacleGradient<Table, numbers, CurvatureField> gradient;
  ObstacleChange<Table> change;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sum) const {
    gradient.add(i);
    sum[0] += change.change(i);
  }
};

template <class Table>
struct ObstacleForm {
  Table table;
  typename Table::Positions x;
  typename Table::Vectors p;
  [[gnu::noinline]] KOKKOS_FUNCTION double form(int i) const {
    if (!table.free(i)) return 0;
    ObstacleForce const r = obstacle_force(table, i, x, true);
    if (r.contacts == 0) return 0;
    return Kokkos::max(quadratic(r.hessian, table.step(i, p, 1)), 0.0);
  }
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sum) const { sum[0] += form(i); }
};

/// The share of each vertex (DivisibleTerm).
template <class Form, class S>
struct ObstacleShares {
  Form of;
  double scale;
  Array<double, S> shares;
  KOKKOS_FUNCTION void operator()(int i) const { shares(of.table.vertex(i)) += scale * of.form(i); }
};

template <class Table>
struct ObstacleProduct {
  using Real = typename Table::Real;
  Table table;
  typename Table::Positions x;
  typename Table::Vectors p;
  double scale;
  typename Table::Vectors hp;
  [[gnu::noinline]] KOKKOS_FUNCTION void add(int i) const {
    if (!table.free(i)) return;
    ObstacleForce const r = obstacle_force(table, i, x, true);
    if (r.contacts == 0) return;
    Vec3<double> const y = r.hessian * table.step(i, p, 1);
    int const v = table.vertex(i);
    for (int c = 0; c < 3; ++c) hp(v, c) += static_cast<Real>(scale * y[c]);
  }
  KOKKOS_FUNCTION void operator()(int i) const { add(i); }
};

template <class Table, class S>
struct ObstacleAssemble {
  Table table;
  typename Table::Positions x;
  double scale;
  BlockCsr<S, double> matrix;
  [[gnu::noinline]] KOKKOS_FUNCTION void add(int i) const {
    if (!table.free(i)) return;
    ObstacleForce const r = obstacle_force(table, i, x, true);
    if (r.contacts > 0) {
      matrix.add(table.vertex(i), table.vertex(i), scale * to_matrix(r.hessian));
    }
  }
  KOKKOS_FUNCTION void operator()(int i) const { add(i); }
};

/// Marks the vertices on which faces act.
template <class Table, class S>
struct MarkTouched {
  Table table;
  typename Table::Positions x;
  Array<int, S> marks;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (touched(i)) marks(table.vertex(i)) = 1;
  }
  [[gnu::noinline]] KOKKOS_FUNCTION bool touched(int i) const {
    return table.free(i) && obstacle_force(table, i, x, false).contacts > 0;
  }
};

/// The force on the bodies, N, and how many faces act.
template <class Table>
struct SumObstacleForces {
  Table table;
  typename Table::Positions x;
  [[gnu::noinline]] KOKKOS_FUNCTION ObstacleForce force(int i) const {
    return table.free(i) ? obstacle_force(table, i, x, false) : ObstacleForce{};
  }
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 4>& sum) const {
    ObstacleForce const r = force(i);
    for (int c = 0; c < 3; ++c) sum[c] -= r.gradient[c];
    sum[3] += r.contacts;
  }
};

/// How far surface vertex i is from the nearest face, m.
template <class Table>
struct FaceGap {
  Table table;
  typename Table::Positions x;
  [[gnu::noinline]] KOKKOS_FUNCTION double operator()(int i) const {
    Vec3<double> const w = table.from_centre(i, x);
    double least = Kokkos::Experimental::infinity_v<double>;
    for (int f = 0; f < table.faces.count; ++f) {
      least = Kokkos::min(least, distance_to(table.faces.face[f], w).distance);
    }
    return least;
  }
};

/// Lowers to the share that is left of the distance below which a vertex is acted on.
template <class Table>
struct LeastObstacleGap {
  FaceGap<Table> gap;
  KOKKOS_FUNCTION void operator()(int i, double& least) const {
    if (gap.table.free(i)) least = Kokkos::min(least, gap(i) / gap.table.activation(i));
  }
};

/// The least certain distance of what is not held by the obstacle, and whose it is: the number
/// most_faces * i + f. Marks what is: the fixed vertices that are not inside; all of them if
/// `anew`, else those that were.
template <class Table>
struct EnterObstacle : BoundReduction {
  Table table;
  typename Table::Positions x;
  bool anew;

  [[gnu::noinline]] KOKKOS_FUNCTION double gap(int i, int f) const {
    FacePath const path(Vec3<typename Table::Position>{x(table.vertex(i), 0), x(table.vertex(i), 1),
                                                       x(table.vertex(i), 2)},
                        Vec3<float>{0, 0, 0}, table.faces.origin, table.faces.face[f], {});
    return path.separation();
  }
  KOKKOS_FUNCTION void operator()(int i, BoundedStep& step) const {
    int worst = 0;
    double least = Kokkos::Experimental::infinity_v<double>;
    for (int f = 0; f < table.faces.count; ++f) {
      double const g = gap(i, f);
      if (!(g >= least)) least = g, worst = f;  // not a number is the least
    }
    bool const inside = least > 0;
    bool const may_be_held = !table.free(i) && (anew || table.held(i));
    table.held(i) = may_be_held && !inside;
    if (table.held(i)) return;
    constexpr double infinity = Kokkos::Experimental::infinity_v<double>;
    add(step, table.faces.most * i + worst, least == least ? least : -infinity, Settled::cut);
  }
};

/// What all vertices allow; the pair is most_faces * i + f. Below 0: a vertex goes nowhere finite.
template <class Table>
struct BoundFaces : BoundReduction {
  Table table;
  Clearance clearance;
  FaceMotion motion;
  typename Table::Positions x;
  typename Table::Vectors p;

  [[gnu::noinline]] KOKKOS_FUNCTION Reach<double> reach(int i, int f) const {
    return table.path(i, f, x, p, motion).reach(clearance, at_most);
  }
  KOKKOS_FUNCTION void operator()(int i, BoundedStep& step) const {
    Vec3<double> const s = table.step(i, p, 1);
    bool const finite = Kokkos::isfinite(s[0]) && Kokkos::isfinite(s[1]) && Kokkos::isfinite(s[2]);
    if (!finite) return add(step, table.faces.most * i, -1, Settled::uncertain);
    if (table.held(i)) return;
    for (int f = 0; f < table.faces.count; ++f) {
      Reach<double> const r = reach(i, f);
      add(step, table.faces.most * i + f, r.alpha, r.settled);
    }
  }
};

/// The longest way that the obstacle takes what is at the vertices, m.
template <class Table>
struct LongestCarry {
  Table table;
  FaceMotion motion;
  Mat3<double> turn;  ///< the whole of it
  typename Table::Positions x;
  [[gnu::noinline]] KOKKOS_FUNCTION double way(int i) const {
    Vec3<double> const w = table.from_centre(i, x);
    return norm(motion.along + (turn * w - w));
  }
  KOKKOS_FUNCTION void operator()(int i, double& longest) const {
    longest = Kokkos::max(longest, way(i));
  }
};

}  // namespace taut::kernels
