// The loops of slip.hpp.
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/core/potential/term.hpp>
#include <taut/mpm/boundary.hpp>

namespace taut {
namespace kernels {

/// One node in one boundary.
struct SlipPair {
  int boundary = 0;
  Vec3<double> normal{}, target{};  ///< where the node would be if it went with the boundary, m
  double force = 0;                 ///< f, N
  double friction_force = 0;        ///< mu f, N
  bool separates = false;
  bool held = true;  ///< for this minimisation; always, unless it separates

  /// What the boundary pushes with, N, given n . d; negative where it pulls.
  KOKKOS_FUNCTION double push(double stiffness, double depth) const {
    return held ? force - stiffness * depth : 0;
  }
};

template <class S>
struct SlipViews {
  Kokkos::View<int*, typename S::memory> begin;  ///< per node, +1
  Kokkos::View<SlipPair*, typename S::memory> pair;
  Kokkos::View<double*, typename S::memory> stiffness;  ///< per node, N/m
  double stick = 1;                                     ///< e, m
  bool friction = false, separates = false;             ///< of any boundary
};

KOKKOS_FORCEINLINE_FUNCTION bool slides(Boundary const& b) {
  return b.contact != BoundaryContact::sticky;
}

template <class S, class Positions>
struct CountSlip {
  Kokkos::View<Boundary const*, typename S::memory> boundaries;
  int count;
  Positions rest;
  KOKKOS_FUNCTION int operator()(int n) const {
    Vec3<double> const x{double(rest(n, 0)), double(rest(n, 1)), double(rest(n, 2))};
    Vec3<double> normal;
    int held = 0;
    for (int k = 0; k < count; ++k) held += holds(boundaries(k), x, normal);
    return held;
  }
  /// Where a boundary has no normal, too deep in it, there is nothing to hold along.
  KOKKOS_FUNCTION static bool holds(Boundary const& b, Vec3<double> const& x,
                                    Vec3<double>& normal) {
    return slides(b) && b.distance(x, normal) <= 0 && dot(normal, normal) > 0;
  }
};

template <class S, class Positions>
struct ListSlip {
  CountSlip<S, Positions> of;
  double h;
  SlipViews<S> to;
  KOKKOS_FUNCTION void operator()(int n) const {
    Vec3<double> const x{double(of.rest(n, 0)), double(of.rest(n, 1)), double(of.rest(n, 2))};
    int at = to.begin(n);
    for (int k = 0; k < of.count; ++k) {
      Boundary const& b = of.boundaries(k);
      SlipPair pair;
      if (!of.holds(b, x, pair.normal)) continue;
      pair.boundary = k;
      pair.target = x + h * b.velocity_at(x);
      pair.separates = b.contact == BoundaryContact::separate;
      to.pair(at++) = pair;
    }
  }
};

/// What a step begins with: stiffness, what is held, and by which forces: those that it takes for
/// the node to go with the boundary while all that is elastic stays as it is.
template <class S, class Precision>
struct BeginSlip {
  using Real = typename Precision::real;
  SlipViews<S> views;
  Kokkos::View<Boundary const*, typename S::memory> boundaries;
  StepStart<Precision, S> start;
  Array<Real, S> mass;
  double steepness;
  KOKKOS_FUNCTION void operator()(int n) const {
    views.stiffness(n) = steepness * double(start.stiffness(n));
    double const inertia = double(mass(n)) / start.scale;
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair& p = views.pair(k);
      double force = 0;
      for (int c = 0; c < 3; ++c) {
        force += p.normal[c] * (double(start.gradient(n, c)) / start.scale -
                                inertia * (double(start.x(n, c)) - p.target[c]));
      }
      p.held = !p.separates || force > 0;
      p.force = p.held ? force : 0;
      p.friction_force = boundaries(p.boundary).friction * Kokkos::max(0.0, p.force);
    }
  }
};

/// The energy (J) of one node in its boundaries, and its derivatives.
template <class S>
struct SlipEnergy {
  SlipViews<S> views;

  /// g(y) / e and g'(y) / y times e, both smooth at 0.
  KOKKOS_FUNCTION static double smooth(double y) {
    return y < 1 ? y * y * (1 - y / 3) : y - 1.0 / 3;
  }
  KOKKOS_FUNCTION static double slope_over(double y) { return y < 1 ? 2 - y : 1 / y; }

  KOKKOS_FUNCTION Vec3<double> along(SlipPair const& p, Vec3<double> const& d) const {
    return (1 / views.stick) * (d - dot(p.normal, d) * p.normal);
  }
  /// The gradient of D.
  KOKKOS_FUNCTION Vec3<double> rub(SlipPair const& p, Vec3<double> const& d) const {
    Vec3<double> const u = along(p, d);
    return (p.friction_force * slope_over(norm(u))) * u;
  }
  /// V(x + s) - V(x)
  KOKKOS_FUNCTION double change(int n, Vec3<double> const& x, Vec3<double> const& s) const {
    double sum = 0;
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair const& p = views.pair(k);
      Vec3<double> const d = x - p.target;
      double const step = dot(p.normal, s), middle = dot(p.normal, d) + 0.5 * step;
      sum -= step * p.push(views.stiffness(n), middle);
      if (p.friction_force > 0) {
        double const from = norm(along(p, d)), to = norm(along(p, d + s));
        sum += p.friction_force * views.stick * (smooth(to) - smooth(from));
      }
    }
    return sum;
  }
  KOKKOS_FUNCTION double value(int n, Vec3<double> const& x) const {
    double sum = 0;
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair const& p = views.pair(k);
      Vec3<double> const d = x - p.target;
      double const depth = dot(p.normal, d);
      sum -= depth * p.push(views.stiffness(n), 0.5 * depth);
      if (p.friction_force > 0) sum += p.friction_force * views.stick * smooth(norm(along(p, d)));
    }
    return sum;
  }
  KOKKOS_FUNCTION Vec3<double> gradient(int n, Vec3<double> const& x) const {
    Vec3<double> sum{};
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair const& p = views.pair(k);
      Vec3<double> const d = x - p.target;
      sum = sum - p.push(views.stiffness(n), dot(p.normal, d)) * p.normal;
      if (p.friction_force > 0) {
        sum = sum + rub(p, d);
      }
    }
    return sum;
  }
  /// Positive semi-definite: of friction, that of a spring with the same force.
  KOKKOS_FUNCTION Sym3<double> curvature(int n, Vec3<double> const& x) const {
    Sym3<double> sum{};
    for (int k = views.begin(n); k < views.begin(n + 1); ++k) {
      SlipPair const& p = views.pair(k);
      Vec3<double> const d = x - p.target, &m = p.normal;
      double across = p.held ? views.stiffness(n) : 0, isotropic = 0;
      if (p.friction_force > 0) {
        isotropic = p.friction_force * slope_over(norm(along(p, d))) / views.stick;
        across -= isotropic;
      }
      constexpr int row[6] = {0, 1, 2, 0, 1, 0}, col[6] = {0, 1, 2, 1, 2, 2};
      for (int c = 0; c < 6; ++c) {
        sum.s[c] += across * m[row[c]] * m[col[c]] + (c < 3 ? isotropic : 0);
      }
    }
    return sum;
  }
};

template <class Field>
KOKKOS_FORCEINLINE_FUNCTION Vec3<double> vector_at(Field const& f, int n) {
  return {double(f(n, 0)), double(f(n, 1)), double(f(n, 2))};
}

template <class S, class Precision>
struct SlipSum {
  using Sum = Sums<typename Precision::sum, 1>;
  SlipEnergy<S> energy;
  VectorField<typename Precision::position, S> x;
  VectorField<typename Precision::real, S> p;
  int what;  ///< 0: value; 1: change by alpha p; 2: p' H p
  double alpha;
  KOKKOS_FUNCTION void operator()(int n, Sum& sum) const {
    if (energy.views.begin(n) == energy.views.begin(n + 1)) return;
    Vec3<double> const at = vector_at(x, n);
    double here;
    if (what == 0) {
      here = energy.value(n, at);
    } else if (what == 1) {
      here = energy.change(n, at, alpha * vector_at(p, n));
    } else {
      here = quadratic(energy.curvature(n, at), vector_at(p, n));
    }
    sum[0] += static_cast<typename Precision::sum>(here);
  }
};

template <class S, class Precision>
struct AddSlip {
  using Real = typename Precision::real;
  SlipEnergy<S> energy;
  VectorField<typename Precision::position, S> x;
  double scale;
  FixedMask<S> fixed;
  VectorField<Real, S> g, p;  ///< p: of a product; empty: the gradient
  VectorField<Real, S> diagonal;
  BlockField<Real, S> blocks;
  KOKKOS_FUNCTION void operator()(int n) const {
    if (fixed(n) || energy.views.begin(n) == energy.views.begin(n + 1)) return;
    Vec3<double> const at = vector_at(x, n);
    Vec3<double> const add =
        p.extent(0) > 0 ? energy.curvature(n, at) * vector_at(p, n) : energy.gradient(n, at);
    for (int c = 0; c < 3; ++c) g(n, c) += static_cast<Real>(scale * add[c]);
    if (diagonal.extent(0) == 0 && blocks.extent(0) == 0) return;
    Sym3<double> const h = energy.curvature(n, at);
    if (blocks.extent(0) > 0) {
      for (int c = 0; c < 6; ++c) blocks(n, c) += static_cast<Real>(scale * h.s[c]);
    } else {
      for (int c = 0; c < 3; ++c) diagonal(n, c) += static_cast<Real>(scale * h.s[c]);
    }
  }
};

template <class S, class Precision, class Matrix>
struct AssembleSlip {
  SlipEnergy<S> energy;
  VectorField<typename Precision::position, S> x;
  double scale;
  FixedMask<S> fixed;
  Matrix matrix;
  KOKKOS_FUNCTION void operator()(int n) const {
    if (fixed(n) || energy.views.begin(n) == energy.views.begin(n + 1)) return;
    matrix.add(n, n, scale * to_matrix(energy.curvature(n, vector_at(x, n))));
  }
};

/// Where a minimisation has ended.
template <class S, class Precision>
struct SlipEnd {
  SlipViews<S> views;
  Kokkos::View<Boundary const*, typename S::memory> boundaries;
  VectorField<typename Precision::position, S> x;

  KOKKOS_FUNCTION double depth(SlipPair const& p, int n) const {
    return dot(p.normal, vector_at(x, n) - p.target);
  }
  KOKKOS_FUNCTION double friction(SlipPair const& p, double push) const {
    return boundaries(p.boundary).friction * Kokkos::max(0.0, push);
  }
};

/// Sums what is still wrong there: the energy (J) that single nodes lose if what pulls lets go and
/// what is in the solid is held; and the squares of the changes of friction forces, and of these.
template <class S, class Precision>
struct SlipErrors {
  using Sum = Sums<typename Precision::sum, 3>;
  SlipEnd<S, Precision> end;
  FixedMask<S> fixed;
  double steepness;
  KOKKOS_FUNCTION void operator()(int n, Sum& sum) const {
    if (fixed(n)) return;
    double energy = 0, change = 0, all = 0;
    for (int k = end.views.begin(n); k < end.views.begin(n + 1); ++k) {
      SlipPair const& p = end.views.pair(k);
      double const resists = end.views.stiffness(n) / steepness, depth = end.depth(p, n);
      double const push = p.push(end.views.stiffness(n), depth);
      if (p.separates && p.held && push < 0) energy += 0.5 * push * push / resists;
      if (!p.held && depth < 0) energy += 0.5 * resists * depth * depth;
      double const friction = end.friction(p, push);
      change += (friction - p.friction_force) * (friction - p.friction_force);
      all += friction * friction;
    }
    using Scalar = typename Precision::sum;
    sum[0] += static_cast<Scalar>(energy);
    sum[1] += static_cast<Scalar>(change);
    sum[2] += static_cast<Scalar>(all);
  }
};

/// Lets go what pulls, holds what is in the solid, and takes the forces as they are.
template <class S, class Precision>
struct RelagSlip {
  SlipEnd<S, Precision> end;
  KOKKOS_FUNCTION void operator()(int n) const {
    for (int k = end.views.begin(n); k < end.views.begin(n + 1); ++k) {
      SlipPair& p = end.views.pair(k);
      double const depth = end.depth(p, n), push = p.push(end.views.stiffness(n), depth);
      if (p.separates) p.held = p.held ? push >= 0 : depth < 0;
      p.force = p.held ? push : 0;
      p.friction_force = end.friction(p, p.force);
    }
  }
};

/// Sums the force of a boundary on the nodes.
template <class S, class Precision>
struct SlipForce {
  using Sum = Sums<typename Precision::sum, 3>;
  SlipEnd<S, Precision> end;
  FixedMask<S> fixed;
  int boundary;
  KOKKOS_FUNCTION void operator()(int n, Sum& sum) const {
    if (fixed(n)) return;
    Vec3<double> force{};
    for (int k = end.views.begin(n); k < end.views.begin(n + 1); ++k) {
      SlipPair const& p = end.views.pair(k);
      if (p.boundary != boundary) continue;
      force = force + p.push(end.views.stiffness(n), end.depth(p, n)) * p.normal;
      if (p.friction_force > 0)
        force = force - SlipEnergy<S>{end.views}.rub(p, vector_at(end.x, n) - p.target);
    }
    for (int c = 0; c < 3; ++c) sum[c] += static_cast<typename Precision::sum>(force[c]);
  }
};

}  // namespace kernels

}  // namespace taut
