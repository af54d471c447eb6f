// Keeps candidates over iterations and steps, as long as they can be proved complete.
//
// A search at x0 within the radius R finds every pair closer than R. If since then the vertices
// have moved by u_i = x_i - x0_i, the distance of a pair has changed by max |u_i - u_j| at most,
// which is no more than the diagonal m of the box around all u. So the list holds every pair that
// is closer than r at x if r + m <= R, and R = r + 2 slack lasts until some vertex has moved by
// more than the slack (m <= 2 max |u|), or longer: what all vertices do together does not count, a
// scene in free fall is searched once.
//
// The same bound says when nothing can touch: if a is the distance below which a pair acts, and c
// the least d - a of all candidates at x0, no pair acts at x while m < min(c, R - r). Then the list
// is complete, and not even its distances need be computed.
#pragma once

#include <taut/contact/activation.hpp>
#include <taut/contact/broad_phase.hpp>

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

/// The displacements of the surface since the last search, at the start and the end of a motion,
/// give or take the round-off of both: that of these sums, and that with which the end is stored.
template <class Precision, class S>
struct DisplacementCloud {
  SurfaceViews<S> surface;
  Motion<Precision, S> motion;
  VectorField<double, S> origin;
  KOKKOS_FUNCTION void add(int i, Bounds& bounds) const {
    constexpr double epsilon_x = Kokkos::Experimental::epsilon_v<typename Precision::position>;
    constexpr double epsilon = Kokkos::Experimental::epsilon_v<typename Precision::real>;
    constexpr double epsilon_here = Kokkos::Experimental::epsilon_v<double>;
    int const v = surface.vertex(i);
    Vec3<double> const x0{origin(v, 0), origin(v, 1), origin(v, 2)};
    Vec3<double> const x = motion.start(v), step = motion.step(v);
    for (int c = 0; c < 3; ++c) {
      double const here = 2 * epsilon_here * (Kokkos::abs(x[c]) + Kokkos::abs(x0[c]));
      extend_axis(bounds, c, x[c] - x0[c], here, v);
      if (!motion.moves()) continue;
      double const size = Kokkos::abs(step[c]), end = x[c] + step[c];
      double const stored = here + 2 * epsilon * size + epsilon_x * Kokkos::abs(end);
      extend_axis(bounds, c, end - x0[c], stored, v);
    }
  }
};

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

/// Lowers to d - a of pair k.
template <PairKind kind, class S, class Positions>
struct LeastClearance {
  PairIds<S> ids;
  Positions x;
  Activation<S> activation;
  KOKKOS_FUNCTION void operator()(int k, double& least) const {
    int v[4];
    Vec3<double> y[4];
    read_pair(ids, k, v);
    gather(v, x, y);
    double const distance = closest_points(kind, y).distance;
    least = Kokkos::min(least, distance - activation(kind, v));
  }
};

}  // namespace kernels

/// Candidates that are found again when they have to be. `activation.dhat` is the radius r. The
/// mask of fixed vertices is part of what was searched for: call `forget` where it changes.
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

  /// Makes `candidates()` hold every pair that comes closer than dhat during the motion, unless no
  /// pair acts in it: then it may do less. Waits for the result. Throws Error where `find` does.
  Touch update(Motion<Precision, Space> const& motion) {
    double moved = found_within_ > 0 ? displacement(motion) : 0;
    if (activation_.dhat + moved <= found_within_) {
      ++counters_.reuses;
    } else {
      ++counters_.searches;
      search(motion);
      moved = displacement(motion);
    }
    if (!(moved < clear_for_)) return Touch::possible;
    ++counters_.skipped;
    return Touch::impossible;
  }
  /// Makes the next update search.
  void forget() { found_within_ = 0; }

  Candidates<Space> const& candidates() const { return candidates_; }
  CacheCounters const& counters() const { return counters_; }

private:
  /// A bound of how far any two vertices have moved against each other, m.
  double displacement(Motion<Precision, Space> const& motion) const {
    SurfaceViews<Space> const& surface = search_.surface();
    if (surface.vertices() == 0) return 0;
    using Cloud = kernels::DisplacementCloud<Precision, Space>;
    kernels::Bounds const b = kernels::find_bounds<Space>("candidate_moved", surface.vertices(),
                                                          Cloud{surface, motion, origin_});
    refuse_stray(b);
    return std::hypot(b.high[0] - b.low[0], b.high[1] - b.low[1], b.high[2] - b.low[2]);
  }

  /// Around the start of the motion, far enough for its end.
  void search(Motion<Precision, Space> const& motion) {
    SurfaceViews<Space> const& surface = search_.surface();
    found_within_ = 0;  // should it throw
    Motion<Precision, Space> at_start = motion;
    at_start.p = {};
    for_each<Space>("candidate_origin", surface.vertices(),
                    kernels::KeepOrigin<Precision, Space>{surface, motion.x, origin_});
    double const within = activation_.dhat + displacement(motion) + 2 * slack_;
    search_.find(at_start, within, candidates_);
    double clear = within - activation_.dhat;
    clear = clearance(candidates_.point_triangle, motion.x, clear);
    clear_for_ = clearance(candidates_.edge_edge, motion.x, clear);
    found_within_ = within;
  }

  template <PairKind kind>
  double clearance(CandidateList<kind, Space> const& list, Positions const& x,
                   double ceiling) const {
    using Least = kernels::LeastClearance<kind, Space, Positions>;
    return minimum<Space>("candidate_clearance", list.count(), ceiling,
                          Least{list.ids(), x, activation_});
  }

  PairSearch<Policy> search_;
  Activation<Space> activation_;
  double slack_ = 0;
  VectorField<double, Space> origin_;
  Candidates<Space> candidates_;
  double found_within_ = 0;  ///< R; 0: nothing has been found
  double clear_for_ = 0;     ///< nothing acts until two vertices have moved this much
  CacheCounters counters_;
};

}  // namespace taut
