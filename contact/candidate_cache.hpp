// Keeps candidates over iterations and steps, as long as they can be proved complete.
//
// Let a be the distance below which a pair acts, but half of dhat at least: what is left out may
// not touch even where it never acts. A search at x0 finds every pair, and those stay of which
//
//   d(x0) < a + reach.
//
// If since then the vertices have moved by u_i = x_i - x0_i, the distance of a pair has changed by
// no more than the diagonal m of the box around their u (displacement.hpp), so the list holds every
// pair that is closer than its a at x if m <= reach. Pairs of one body and pairs of two have an m
// and a reach of their own: bodies that fly at each other make no candidates within themselves.
// reach = 2 slack lasts until some vertex has moved by more than the slack, or longer: what all do
// together does not count, a scene in free fall is searched once. Where a motion goes further than
// that, boxes around the paths of the primitives say which pairs may meet on the way, and for each
// pair its own relative motion takes the place of the reach: few pairs move as far against each
// other as the two that do so most. Neighbours in one body, whose
// boxes overlap for ever, are no candidates unless they come to act: a body far from all others has
// none.
//
// The same bound says what cannot touch. A pair of the list does not act at x while m < d - a, with
// d kept from the search: one number to read instead of four vertices. Where that holds for all,
// the list need not be looked at.
#pragma once

#include <taut/contact/activation.hpp>
#include <taut/contact/broad_phase.hpp>
#include <taut/contact/displacement.hpp>

namespace taut {

/// What an update of the cache came to.
enum class Touch {
  possible,   ///< the candidates are complete; some of them may act
  impossible  ///< no pair acts
};

struct CacheCounters {
  std::int64_t searches = 0;  ///< updates that searched
  std::int64_t reuses = 0;    ///< updates that found the candidates complete
  std::int64_t skipped = 0;   ///< updates that found that nothing can touch (among the former two)
};

namespace kernels {

template <class Precision, class S>
struct KeepOrigin {
  SurfaceViews<S> surface;
  VectorField<typename Precision::position, S> x;
  VectorField<double, S> origin;
  KOKKOS_FUNCTION void operator()(int i) const {
    int const v = surface.vertex(i);
    for (int c = 0; c < 3; ++c) origin(v, c) = double(x(v, c));
  }
};

/// Keeps pairs that may act, or be half of dhat apart, once their distance has fallen by `reach`,
/// or in the course of `motion`.
template <class Precision, class S>
struct WithinReach {
  Activation<S> activation;
  Displacement reach;
  Motion<Precision, S> motion;

  /// Compiled once, as what contact_kernels.hpp computes: which pairs are candidates must not
  /// depend on the number of threads.
  [[gnu::noinline]] KOKKOS_FUNCTION bool operator()(PairKind kind, int const (&v)[4],
                                                    Vec3<double> const (&y)[4]) const {
    double const low = distance_below(kind, y);
    double far = activation.one_body(v) ? reach.within : reach.between;
    if (motion.moves()) far = Kokkos::max(far, relative_motion(v, y));
    if (!(low < activation.dhat + far)) return false;
    return low < Kokkos::max(activation(kind, v), 0.5 * activation.dhat) + far;
  }
  /// Of the vertices of a pair against each other, and what storing their ends may add.
  KOKKOS_FUNCTION double relative_motion(int const (&v)[4], Vec3<double> const (&y)[4]) const {
    constexpr double epsilon_x = Kokkos::Experimental::epsilon_v<typename Precision::position>;
    constexpr double epsilon = Kokkos::Experimental::epsilon_v<typename Precision::real>;
    Vec3<double> step[4];
    double error = 0, longest = 0;
    for (int a = 0; a < 4; ++a) {
      step[a] = motion.step(v[a]);
      error += 4 * epsilon * norm(step[a]) + 2 * epsilon_x * norm(y[a] + step[a]);
      for (int b = 0; b < a; ++b) longest = Kokkos::max(longest, norm(step[a] - step[b]));
    }
    return longest + error;
  }
  /// The distance, less the round-off of computing it.
  KOKKOS_FUNCTION static double distance_below(PairKind kind, Vec3<double> const (&y)[4]) {
    double size = 0;
    for (int a = 1; a < 4; ++a) size += norm(y[a] - y[0]);
    // As for CloserThan.
    constexpr double budget = 16 * Kokkos::Experimental::epsilon_v<double>;
    return closest_points(kind, y).distance - budget * size;
  }
};

/// Raises to the longest step of a vertex.
template <class Precision, class S>
struct LongestStep {
  SurfaceViews<S> surface;
  Motion<Precision, S> motion;
  KOKKOS_FUNCTION void operator()(int i, double& longest) const {
    longest = Kokkos::max(longest, length(i));
  }
  [[gnu::noinline]] KOKKOS_FUNCTION double length(int i) const {
    return norm(motion.step(surface.vertex(i)));
  }
};

/// Notes the distance of pair k, and lowers to what is left of it beyond activation, of pairs of
/// one body or of two.
template <PairKind kind, class S, class Positions>
struct LeastClearance {
  PairIds<S> ids;
  Positions x;
  Activation<S> activation;
  Array<float, S> distance;
  bool one_body;
  KOKKOS_FUNCTION void operator()(int k, double& least) const {
    least = Kokkos::min(least, note(k, least));
  }
  /// Compiled once, as well. What is left, or `other` of a pair of the other sort.
  [[gnu::noinline]] KOKKOS_FUNCTION double note(int k, double other) const {
    int v[4];
    read_pair(ids, k, v);
    bool const one = activation.one_body(v);
    if (one != one_body) return other;
    Vec3<double> y[4];
    gather(v, x, y);
    double const low = WithinReach<Fp64, S>::distance_below(kind, y);
    distance(k) = pair_length(one, FoundDistances<S>::shaded(low, y));
    return low - activation(kind, v);
  }
};

}  // namespace kernels

/// Candidates that are found again when they have to be. The mask of fixed vertices is part of what
/// was searched for: call `forget` where it changes.
template <BroadPhase Policy, class Precision = Mixed>
class CandidateCache {
public:
  using Space = typename Policy::Space;
  using Positions = VectorField<typename Precision::position, Space>;
  struct Params {
    double slack = 0.25;  ///< of dhat
    typename Policy::Params search = {};
  };

  CandidateCache() = default;
  /// `edge_length`: mean length of the surface's edges, m. Throws Error unless the activation
  /// distance is positive, its fraction in (0, 1), and the slack not negative.
  CandidateCache(SurfaceViews<Space> const& surface, double edge_length,
                 Activation<Space> const& activation, Params const& params = {})
      : search_(surface, edge_length, params.search),
        activation_(activation),
        slack_(params.slack * activation.dhat),
        displacements_(surface),
        origin_("candidate_origin", surface.object.extent(0)) {
    if (!(activation.dhat > 0 && activation.fraction > 0 && activation.fraction < 1 &&
          params.slack >= 0)) {
      throw Error(
          "contact: an activation distance of {} m, {} of the distance at rest at most, and a "
          "slack "
          "of {}: give a positive length, a fraction between 0 and 1, and no negative slack",
          activation.dhat, activation.fraction, params.slack);
    }
  }

  /// Makes `candidates()` hold every pair that during the motion comes closer than it acts, or than
  /// half of dhat, unless no pair acts in it: then it may do less. Waits for the result. Throws
  /// Error where `find` does.
  Touch update(Motion<Precision, Space> const& motion) {
    if (complete_) {
      moved_ = displacements_.measure(motion, origin_);
      complete_ = moved_.within <= reach_.within && moved_.between <= reach_.between;
    }
    if (complete_) {
      ++counters_.reuses;
    } else {
      ++counters_.searches;
      search(motion);
    }
    bool const clear = moved_.within < clear_for_.within && moved_.between < clear_for_.between;
    if (!clear) return Touch::possible;
    ++counters_.skipped;
    return Touch::impossible;
  }
  /// Makes the next update search.
  void forget() { complete_ = false; }

  Candidates<Space> const& candidates() const { return candidates_; }
  /// How far apart the candidates of a kind were when they were found, and how far they may have
  /// moved against each other by the end of the motion that was last asked for.
  template <PairKind kind>
  FoundDistances<Space> distances() const {
    return {kind == PairKind::point_triangle ? triangle_distance_ : edge_distance_, moved_};
  }
  CacheCounters const& counters() const { return counters_; }

private:
  /// Around the start of the motion, far enough for its end.
  void search(Motion<Precision, Space> const& motion) {
    SurfaceViews<Space> const& surface = search_.surface();
    Motion<Precision, Space> at_start = motion;
    at_start.p = {};
    for_each<Space>("candidate_origin", surface.vertices(),
                    kernels::KeepOrigin<Precision, Space>{surface, motion.x, origin_});
    moved_ = displacements_.measure(motion, origin_);
    double const farthest = displacements_.bodies() > 1 ? moved_.between : moved_.within;
    // What goes far with all others has a long path and little to meet on it.
    bool const paths = farthest > 2 * slack_ && longest_step(motion) <= 2 * farthest;
    reach_ = paths ? Displacement{2 * slack_, 2 * slack_}
                   : Displacement{moved_.within + 2 * slack_, moved_.between + 2 * slack_};
    double const radius = activation_.dhat + 2 * slack_ + (paths ? 0 : farthest);
    Motion<Precision, Space> const& along = paths ? motion : at_start;
    search_.find(along, radius, candidates_);
    candidates_.keep(kernels::WithinReach<Precision, Space>{activation_, reach_, along}, motion.x);
    clear_for_ = reach_;
    clearance(candidates_.point_triangle, motion.x, triangle_distance_);
    clearance(candidates_.edge_edge, motion.x, edge_distance_);
    complete_ = true;
  }

  double longest_step(Motion<Precision, Space> const& motion) const {
    return maximum<Space>("candidate_step", search_.surface().vertices(), 0.0,
                          kernels::LongestStep<Precision, Space>{search_.surface(), motion});
  }

  /// Notes the distances of a list and lowers clear_for_.
  template <PairKind kind>
  void clearance(CandidateList<kind, Space> const& list, Positions const& x,
                 Array<float, Space>& distance) {
    if (distance.extent_int(0) < list.count()) {
      distance = {};  // the old memory first
      distance = Array<float, Space>(
          Kokkos::view_alloc(Kokkos::WithoutInitializing, std::string("candidate_distance")),
          static_cast<std::size_t>(list.count()) + list.count() / 2);
    }
    using Least = kernels::LeastClearance<kind, Space, Positions>;
    for (bool one_body : {true, false}) {
      double& clear = one_body ? clear_for_.within : clear_for_.between;
      clear = minimum<Space>("candidate_clearance", list.count(), clear,
                             Least{list.ids(), x, activation_, distance, one_body});
    }
  }

  PairSearch<Policy> search_;
  Activation<Space> activation_;
  double slack_ = 0;
  Displacements<Space> displacements_;
  VectorField<double, Space> origin_;
  Candidates<Space> candidates_;
  Array<float, Space> triangle_distance_, edge_distance_;
  bool complete_ = false;  ///< for the last search's motion, and what has moved by reach_ at most
  Displacement reach_;
  Displacement clear_for_;  ///< nothing acts until so much has moved
  Displacement moved_;      ///< in the motion that was last asked for
  CacheCounters counters_;
};

}  // namespace taut
