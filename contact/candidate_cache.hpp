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
// together does not count, a scene in free fall is searched once.
//
// Where a motion goes further than that, boxes around the paths of the primitives say which pairs
// may meet on the way, and to each pair's reach its own relative motion is added: few pairs move as
// far against each other as the two that do so most. From then on only what departs from that path
// counts as m, so the step that a line search takes along it needs no other search. Neighbours in
// one body, whose boxes overlap for ever, are no candidates unless they come to act: a body far
// from all others has none.
//
// Candidates are chosen among neighbours (neighbours.hpp), which reach a skin further and are kept
// up to date vertex by vertex: choosing costs much less than a search.
//
// The same bound says what cannot touch. A pair of the list does not act at x while m < d - a, with
// d kept from the search: one number to read instead of four vertices. Where that holds for all,
// the list need not be looked at.
#pragma once

#include <taut/contact/neighbours.hpp>

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
  double seconds = 0;         ///< of the searches
};

namespace kernels {

/// Remembers where a motion starts, and where it goes.
template <class Precision, class S>
struct Depart {
  SurfaceViews<S> surface;
  Motion<Precision, S> motion;
  Departure<S> to;
  KOKKOS_FUNCTION void operator()(int i) const {
    int const v = surface.vertex(i);
    Vec3<double> const x = motion.start(v), step = motion.step(v);
    for (int c = 0; c < 3; ++c) {
      to.from(v, c) = x[c];
      to.path(v, c) = step[c];
    }
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

/// Lowers to the first vertex of the mesh that goes as far.
template <class Precision, class S>
struct FindLeader {
  LongestStep<Precision, S> step;
  double longest;
  KOKKOS_FUNCTION void operator()(int i, int& first) const {
    if (step.length(i) >= longest) first = Kokkos::min(first, step.surface.vertex(i));
  }
};

/// Lowers to what is left of the distances of pairs beyond activation.
template <class S>
struct LeastClearance {
  using value_type = Displacement;
  Array<float, S> distance;
  Array<double, S> activation;
  KOKKOS_FUNCTION void operator()(int k, Displacement& least) const {
    float const d = distance(k);
    double const left = double(Kokkos::abs(d)) - activation(k);
    // What is noted as 0 tells no body.
    if (!(d > 0)) least.within = Kokkos::min(least.within, left);
    if (!(d < 0)) least.between = Kokkos::min(least.between, left);
  }
  KOKKOS_FUNCTION void join(Displacement& to, Displacement const& from) const {
    to.within = Kokkos::min(to.within, from.within);
    to.between = Kokkos::min(to.between, from.between);
  }
  KOKKOS_FUNCTION void init(Displacement& least) const {
    constexpr double infinity = Kokkos::Experimental::infinity_v<double>;
    least = {infinity, infinity};
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
    double slack = 0.02;  ///< of dhat
    double skin = 0.5;    ///< of dhat: how far the neighbours that candidates are chosen from reach
    typename Policy::Params search = {};
  };

  CandidateCache() = default;
  /// `edge_length`: mean length of the surface's edges, m. Throws Error unless the activation
  /// distance is positive, its fraction in (0, 1), and the slack not negative.
  CandidateCache(SurfaceViews<Space> const& surface, double edge_length,
                 Activation<Space> const& activation, Params const& params = {})
      : neighbours_(surface, edge_length, params.skin * activation.dhat, params.search),
        activation_(activation),
        slack_(params.slack * activation.dhat),
        displacements_(surface),
        since_(make_departure<Space>(surface.object.extent(0))) {
    if (!(activation.dhat > 0 && activation.fraction > 0 && activation.fraction < 1 &&
          params.slack >= 0 && params.skin >= 0)) {
      throw Error(
          "contact: an activation distance of {} m, {} of the distance at rest at most, a slack "
          "of {} and a skin of {}: give a positive length, a fraction between 0 and 1, and neither "
          "a negative slack nor skin",
          activation.dhat, activation.fraction, params.slack, params.skin);
    }
  }

  /// Makes `candidates()` hold every pair that during the motion comes closer than it acts, or than
  /// half of dhat, unless no pair acts in it: then it may do less. Waits for the result. Throws
  /// Error where `find` does.
  Touch update(Motion<Precision, Space> const& motion) {
    if (complete_) {
      Moved const moved = displacements_.measure(motion, since_);
      moved_ = moved.all;
      complete_ = moved.off.within <= reach_.within && moved.off.between <= reach_.between;
    }
    if (complete_) {
      ++counters_.reuses;
    } else {
      ++counters_.searches;
      Kokkos::Timer const timer;
      search(motion);
      counters_.seconds += timer.seconds();
    }
    bool const clear = moved_.within < clear_for_.within && moved_.between < clear_for_.between;
    if (!clear) return Touch::possible;
    ++counters_.skipped;
    return Touch::impossible;
  }
  /// Whether an update may do without a search through the whole surface.
  bool known() const { return neighbours_.known(); }
  /// Makes the next update search through the whole surface.
  void forget() {
    complete_ = false;
    neighbours_.forget();
  }

  Candidates<Space> const& candidates() const { return candidates_; }
  /// How far apart the candidates of a kind were when they were found, and how far they may have
  /// moved against each other by the end of the motion that was last asked for.
  template <PairKind kind>
  FoundDistances<Space> distances() const {
    if constexpr (kind == PairKind::point_triangle) {
      return {candidates_.point_triangle.distance(), moved_};
    } else {
      return {candidates_.edge_edge.distance(), moved_};
    }
  }
  /// How far vertices may have moved against each other since the search.
  Displacement const& moved() const { return moved_; }
  CacheCounters const& counters() const { return counters_; }
  NeighbourCounters const& neighbour_counters() const { return neighbours_.counters(); }

private:
  using Filter = kernels::WithinReach<Precision, Space>;

  /// Around the start of the motion, far enough for its end.
  void search(Motion<Precision, Space> const& motion) {
    SurfaceViews<Space> const& surface = neighbours_.surface();
    Motion<Precision, Space> at_start = motion;
    at_start.p = {};
    for_each<Space>("candidate_origin", surface.vertices(),
                    kernels::Depart<Precision, Space>{surface, motion, since_});
    since_.leader = -1;
    moved_ = displacements_.measure(motion, since_).all;
    double const farthest = displacements_.bodies() > 1 ? moved_.between : moved_.within;
    Lead const lead = farthest > 2 * slack_ ? follow(motion, 2 * farthest) : Lead{};
    bool const paths = lead.vertex >= 0;
    reach_ = paths ? Displacement{2 * slack_, 2 * slack_}
                   : Displacement{moved_.within + 2 * slack_, moved_.between + 2 * slack_};
    Filter const near{activation_, reach_, paths ? motion : at_start};
    // What nearly rests is not followed, and asks for a reach of up to twice as far.
    neighbours_.update(near, lead, 4 * slack_);
    choose(near, candidates_.point_triangle);
    choose(near, candidates_.edge_edge);
    constexpr double infinity = std::numeric_limits<double>::infinity();
    clear_for_ = {infinity, infinity};
    lower_clearance(candidates_.point_triangle);
    lower_clearance(candidates_.edge_edge);
    complete_ = true;
  }
  template <PairKind kind>
  void choose(Filter const& near, CandidateList<kind, Space>& to) const {
    to.take(neighbours_.template pairs<kind>(), neighbours_.template count<kind>(),
            kernels::StillWithinReach<Precision, Space>{near}, near.motion.x);
  }

  /// Names who leads, unless what goes far does so with all others: that has a long path and little
  /// to meet on it.
  Lead follow(Motion<Precision, Space> const& motion, double at_most) {
    SurfaceViews<Space> const& surface = neighbours_.surface();
    kernels::LongestStep<Precision, Space> const step{surface, motion};
    int const n = surface.vertices();
    double const longest = maximum<Space>("candidate_step", n, 0.0, step);
    if (longest > at_most) return {};
    since_.leader = minimum<Space>("candidate_leader", n, std::numeric_limits<int>::max(),
                                   kernels::FindLeader<Precision, Space>{step, longest});
    for_each<Space>("candidate_lead", 3, kernels::KeepLead<Space>{since_});
    return {since_.leader, longest};
  }

  template <PairKind kind>
  void lower_clearance(CandidateList<kind, Space> const& list) {
    if (list.count() == 0) return;
    kernels::LeastClearance<Space> const find{list.distance(), list.activation()};
    find.join(clear_for_, join_all<Space>("candidate_clearance", list.count(), find));
  }

  Neighbours<Policy, Precision> neighbours_;
  Activation<Space> activation_;
  double slack_ = 0;
  Displacements<Space> displacements_;
  Departure<Space> since_;  ///< the last search
  Candidates<Space> candidates_;
  /// For the path of the last search, and what is off it by reach_ at most.
  bool complete_ = false;
  Displacement reach_;
  Displacement clear_for_;  ///< nothing acts until so much has moved
  Displacement moved_;      ///< in the motion that was last asked for
  CacheCounters counters_;
};

}  // namespace taut
