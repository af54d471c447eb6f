// Step bounds over lists of candidate pairs, and how far the lists themselves reach.
//
// A bound over the candidates is one for all pairs only while no other pair can come close. If the
// list holds every pair closer than `radius` at the positions in which it was made, two features
// that are not on it are still `reserve` apart while no vertex has moved by more than (radius -
// reserve) / 2 since: their distance changes by at most twice the longest motion of a vertex.
#pragma once

#include <taut/contact/candidates.hpp>
#include <taut/contact/vertex_bound.hpp>
#include <taut/core/exec/parallel.hpp>

namespace taut {

/// The shortest bound of a list, and how its pairs were settled.
struct BoundedStep {
  double alpha = 0;                 ///< the bound, in (0, at_most] unless a pair was uncertain
  int pair = -1;                    ///< the first pair that gave it; -1: none is below at_most
  int settled[settled_kinds] = {};  ///< pairs, by what settled them

  int count(Settled how) const { return settled[static_cast<int>(how)]; }

  /// Of two parts of one list; ties go to the earlier pair.
  KOKKOS_INLINE_FUNCTION void join(BoundedStep const& other) {
    bool const earlier = other.pair >= 0 && (pair < 0 || other.pair < pair);
    if (other.alpha < alpha || (other.alpha == alpha && earlier)) {
      alpha = other.alpha;
      pair = other.pair;
    }
    for (int k = 0; k < settled_kinds; ++k) settled[k] += other.settled[k];
  }
};

namespace kernels {

/// The path of pair k, read from fields.
template <class T, PairKind kind, class Positions, class Vectors, class Pairs>
KOKKOS_INLINE_FUNCTION PairPath<T, kind> path_of(Positions const& x, Vectors const& p,
                                                 Pairs const& pairs, int k) {
  Vec3<typename Positions::non_const_value_type> corner[4];
  Vec3<typename Vectors::non_const_value_type> displacement[4];
  for (int a = 0; a < 4; ++a) {
    int const v = pairs(k, a);
    for (int c = 0; c < 3; ++c) {
      corner[a][c] = x(v, c);
      displacement[a][c] = p(v, c);
    }
  }
  return {corner, displacement};
}

/// The reduction of a list to a BoundedStep: a minimum, the first index of it and sums of integers,
/// so its order is free.
struct BoundReduction {
  using value_type = BoundedStep;
  double at_most;

  KOKKOS_FUNCTION void init(BoundedStep& step) const {
    step = {};
    step.alpha = at_most;
  }
  KOKKOS_FUNCTION void join(BoundedStep& to, BoundedStep const& from) const { to.join(from); }
  KOKKOS_FUNCTION static void add(BoundedStep& step, int pair, double alpha, Settled settled) {
    BoundedStep one;
    one.alpha = alpha;
    one.pair = settled == Settled::cut || settled == Settled::uncertain ? pair : -1;
    one.settled[static_cast<int>(settled)] = 1;
    step.join(one);
  }
};

template <class Precision, class S, PairKind kind, class Bound>
struct BoundPairs : BoundReduction {
  using Real = typename Precision::real;

  Bound bound;
  Clearance clearance;
  PairList<S> pairs;
  VectorField<typename Precision::position, S> x;
  VectorField<Real, S> p;
  FoundDistances<S> found;

  /// Whether pair k keeps its clearance whatever its vertices do: it was far enough apart where it
  /// was found.
  KOKKOS_FUNCTION bool out_of_reach(int k) const {
    if constexpr (Bound::by_gap) {
      if (found.at.extent(0) == 0) return false;
      double const most = found.most(k);
      return found.least(k) > most - clearance.usable(most);
    } else {
      return false;
    }
  }

  /// Compiled once: inlined into several loops, it could be contracted to other fused products in
  /// each, and a bound would depend on whether its loop runs in parallel.
  [[gnu::noinline]] KOKKOS_FUNCTION Reach<double> reach(int k) const {
    static_assert(GapBound<Bound, PairPath<double, kind>>,
                  "a step bound needs certify and bound: see GapBound in step_bound.hpp");
    if constexpr (!std::is_same_v<Real, double>) {
      // What is certified for a little more than at_most is certified for it.
      Real const more = static_cast<Real>(at_most) * (1 + budget<Real>);
      auto const quick = bound.certify(path_of<Real, kind>(x, p, pairs, k), clearance, more);
      if (quick.settled != Settled::open && quick.settled != Settled::uncertain) {
        return {Kokkos::min(double(quick.alpha), at_most), double(quick.kept), quick.settled};
      }
    }
    return bound.bound(path_of<double, kind>(x, p, pairs, k), clearance, at_most);
  }

  KOKKOS_FUNCTION void operator()(int k, BoundedStep& step) const {
    if (out_of_reach(k)) {
      ++step.settled[static_cast<int>(Settled::boxes)];
      return;
    }
    auto const r = reach(k);
    add(step, k, r.alpha, r.settled);
  }
};

template <class Precision, class S, PairKind kind, class Bound>
struct BoundVertices : BoundReduction {
  using Position = typename Precision::position;
  using Real = typename Precision::real;

  Bound bound;
  Clearance clearance;
  PairList<S> pairs;
  VectorField<Position, S> x;
  VectorField<Real, S> p;
  Array<Position, S> alpha;

  /// Compiled once, as in BoundPairs.
  [[gnu::noinline]] KOKKOS_FUNCTION VertexReach<double> reach(int k) const {
    static_assert(VertexBound<Bound, PairPath<double, kind>>,
                  "a bound of vertices needs bound: see VertexBound in vertex_bound.hpp");
    return bound.bound(path_of<double, kind>(x, p, pairs, k), clearance, at_most);
  }

  KOKKOS_FUNCTION void operator()(int k, BoundedStep& step) const {
    auto const r = reach(k);
    double least = at_most;
    for (int a = 0; a < 4; ++a) {
      least = Kokkos::min(least, r.alpha[a]);
      // A minimum is the same in any order.
      if (r.alpha[a] < at_most) {
        Kokkos::atomic_min(&alpha(pairs(k, a)), static_cast<Position>(r.alpha[a]));
      }
    }
    add(step, k, least, r.settled);
  }
};

/// How far vertex i may go until it has moved by `allowed` since `found`.
template <class Precision, class S>
struct StayWithin {
  VectorField<typename Precision::position, S> found, x;
  VectorField<typename Precision::real, S> p;
  double allowed, at_most;

  KOKKOS_FUNCTION void operator()(int i, double& smallest) const {
    smallest = Kokkos::min(smallest, reach(i));
  }
  /// Compiled once, as in BoundPairs.
  [[gnu::noinline]] KOKKOS_FUNCTION double reach(int i) const {
    constexpr double unit = Kokkos::Experimental::epsilon_v<typename Precision::position> / 2;
    Vec3<double> moved, step;
    double far = 0, along = 0;
    for (int c = 0; c < 3; ++c) {
      moved[c] = double(x(i, c)) - double(found(i, c));
      step[c] = double(p(i, c));
      far += step[c] == 0 ? 0 : Kokkos::abs(double(x(i, c)));
      along += Kokkos::abs(step[c]);
    }
    constexpr double more = 1 + budget<double>, less = 1 - budget<double>;
    double const speed = more * norm(step) + 4 * unit * along;
    if (speed == 0) return at_most;
    double const room = less * allowed - more * (norm(moved) + unit * far);
    return share_of(room, speed, at_most);
  }
};

inline void check_clearance(Clearance const& clearance, double at_most) {
  if (!(clearance.share > 0 && clearance.share < 1)) {
    throw Error("step bound: the share of a gap that a step may use is {}: give one in (0, 1)",
                clearance.share);
  }
  if (!(clearance.least >= 0) || !(clearance.ample > 0)) {
    throw Error(
        "step bound: least = {} m and ample = {} m: give a distance of at least 0 and one "
        "above 0",
        clearance.least, clearance.ample);
  }
  if (!(at_most > 0)) {
    throw Error("step bound: at most {} of a step is asked for: give a length above 0", at_most);
  }
}

}  // namespace kernels

/// The largest alpha in (0, at_most] that `bound` certifies for the first n pairs of a list, from
/// the positions x (m) along p (m): 0 where a pair is `uncertain`, which is for the caller to
/// report. Rounding alpha to Precision::position is allowed for. Pairs that Precision::real does
/// not settle by certificates are decided in fp64. `found`, where it is known for this step (as the
/// cache knows it), settles what is out of reach without a look. Waits for the result. Throws Error
/// if the clearance or at_most makes no sense.
template <class Precision, class S, PairKind kind, class Bound>
BoundedStep bound_step(Bound const& bound, Clearance const& clearance, PairList<S> const& pairs,
                       int n, VectorField<typename Precision::position, S> const& x,
                       VectorField<typename Precision::real, S> const& p, double at_most,
                       FoundDistances<S> const& found = {}) {
  kernels::check_clearance(clearance, at_most);
  return join_all<S>("contact_step_bound", n,
                     kernels::BoundPairs<Precision, S, kind, Bound>{
                         {at_most}, bound, clearance, pairs, x, p, found});
}

/// The same for each vertex by itself: lowers alpha(v) of the vertices of each pair. Returns the
/// smallest of all.
template <class Precision, class S, PairKind kind, class Bound>
BoundedStep bound_vertices(Bound const& bound, Clearance const& clearance, PairList<S> const& pairs,
                           int n, VectorField<typename Precision::position, S> const& x,
                           VectorField<typename Precision::real, S> const& p, double at_most,
                           Array<typename Precision::position, S> const& alpha) {
  kernels::check_clearance(clearance, at_most);
  return join_all<S>("contact_vertex_bound", n,
                     kernels::BoundVertices<Precision, S, kind, Bound>{
                         {at_most}, bound, clearance, pairs, x, p, alpha});
}

/// How far the step p from x may go, in [0, at_most], while pairs that were `radius` apart or more
/// at the positions `found` stay `reserve` apart (m). 0: search anew. Throws Error unless 0 <=
/// reserve < radius.
template <class Precision, class S>
double covered_step(VectorField<typename Precision::position, S> const& found, double radius,
                    double reserve, VectorField<typename Precision::position, S> const& x,
                    VectorField<typename Precision::real, S> const& p, double at_most) {
  if (!(reserve >= 0 && reserve < radius)) {
    throw Error(
        "contact candidates within {} m leave nothing to move if pairs are to stay {} m "
        "apart: search further",
        radius, reserve);
  }
  double const allowed = (radius - reserve) / 2;
  return minimum<S>("contact_covered_step", static_cast<int>(x.extent(0)), at_most,
                    kernels::StayWithin<Precision, S>{found, x, p, allowed, at_most});
}

}  // namespace taut
