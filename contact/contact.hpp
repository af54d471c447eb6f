// Contact between surfaces: a swept term of the potential,
//
//   V(x) = Sum over pairs K m(q) b(d),   a point and a triangle, or two edges, at the distance d,
//
// with barrier, curvature and mollifier of a PairEnergy (pair.hpp), the pairs that a cache proves
// complete (candidate_cache.hpp), a step bound (step_bound.hpp) and a stiffness rule
// (stiffness.hpp). Li et al. 2020, "Incremental Potential Contact"; Shen et al. 2024.
//
// No step may be longer than max_step says: then nothing crosses that had not crossed before.
#pragma once

#include <taut/contact/adaptive_stiffness.hpp>
#include <taut/contact/bvh.hpp>
#include <taut/contact/candidate_cache.hpp>
#include <taut/contact/contact_islands.hpp>
#include <taut/contact/contact_pairs.hpp>
#include <taut/contact/contact_report.hpp>
#include <taut/contact/lag_pairs.hpp>
#include <taut/contact/start_gaps.hpp>
#include <taut/contact/step_bound_sweep.hpp>
#include <taut/core/potential/term.hpp>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

namespace taut {

/// The pair that a step bound stopped at.
struct LimitingPair {
  PairKind kind;
  std::array<int, 4> vertices;  ///< in the order of `kind`
  double alpha;  ///< the bound; 0: the gap is nil or not above round-off, no step is proved safe
};

template <class Pair_ = PairEnergy<>, class Search_ = Bvh<DefaultSpace>, class Bound_ = AdditiveCcd,
          class Stiffness_ = ElasticInclusiveStiffness, class Precision_ = Mixed,
          class Space_ = typename Search_::Space>
class Contact {
public:
  using Pair = Pair_;
  using Space = Space_;
  using Precision = Precision_;
  using Real = typename Precision::real;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<Real, Space>;
  using Blocks = BlockField<Real, Space>;
  using Matrix = BlockCsr<Space, double>;
  using Fixed = FixedMask<Space>;
  using Cache = CandidateCache<Search_, Precision>;

  static_assert(std::same_as<typename Search_::Space, Space>,
                "taut: the search of a Contact must live in its Space");
  static_assert(StiffnessRule<Stiffness_, Precision, Space>,
                "taut: the stiffness of a Contact must satisfy StiffnessRule "
                "(contact/stiffness.hpp)");
  static_assert(GapBound<Bound_, PairPath<double, PairKind::edge_edge>>,
                "taut: the bound of a Contact must satisfy GapBound (contact/step_bound.hpp)");

  struct Params {
    std::optional<double> dhat = {};  ///< m; else default_dhat (surface.hpp)
    double cap = 0.5;  ///< of the distance at rest, for pairs of one body (activation.hpp)
    /// Of the gap that two bodies start with, below which they act; 0: below dhat, however close
    /// they start (start_activation.hpp).
    double start_share = 0.9;
    Stiffness_ stiffness = {};
    double mollifier_threshold = EdgeMollifier::default_threshold;
    Bound_ bound = {};
    /// A step leaves this of a gap, or of dhat where the gap is larger: `ample` is no more than
    /// dhat.
    Clearance clearance = {.share = 0.45};
    typename Cache::Params search = {};
  };

  /// `rest`: where the vertices are at rest, m, one per unknown. Pairs whose vertices are all fixed
  /// in `unknowns` exert nothing, and are kept apart if they are fixed by different marks. Copies
  /// share everything: they are one contact. Throws Error where something does not fit or has no
  /// size.
  Contact(Unknowns<Precision, Space> const& unknowns, Surface const& surface,
          std::vector<Point> const& rest, Params const& params)
      : state_(std::make_shared<State>(unknowns, surface, rest, params)) {}

  double value(Positions const& x, double scale) const {
    if (!state_->may_act(x)) return 0;
    using Kernel = kernels::PairValue<Pair, Precision, Space>;
    return scale * state_->table.sum("contact_value", Kernel{pairs(), x});
  }
  double change(Positions const& x, Vectors const& p, double alpha, double scale) const {
    if (!state_->may_act(x, p, alpha)) return 0;
    using Kernel = kernels::PairChange<Pair, Precision, Space>;
    return scale * state_->table.sum("contact_change", Kernel{pairs(), x, p, alpha});
  }
  double quadratic_form(Positions const& x, Vectors const& p, double scale) const {
    if (!state_->may_act(x)) return 0;
    using Kernel = kernels::PairForm<Pair, Precision, Space>;
    return scale * state_->table.sum("contact_form", Kernel{pairs(), x, p, state_->table.known(x)});
  }

  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g) const {
    gradient<0>(x, scale, fixed, g, g);
  }
  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g,
                    Vectors const& diagonal) const {
    gradient<3>(x, scale, fixed, g, diagonal);
  }
  void add_gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g,
                    Blocks const& blocks) const {
    gradient<6>(x, scale, fixed, g, blocks);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const& fixed, Vectors const& g) const {
    return gradient_after<0>(x, p, alpha, scale, fixed, g, g);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const& fixed, Vectors const& g, Vectors const& diagonal) const {
    return gradient_after<3>(x, p, alpha, scale, fixed, g, diagonal);
  }
  double add_gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                            Fixed const& fixed, Vectors const& g, Blocks const& blocks) const {
    return gradient_after<6>(x, p, alpha, scale, fixed, g, blocks);
  }

  void add_product(Positions const& x, Vectors const& p, double scale, Fixed const& fixed,
                   Vectors const& hp) const {
    if (!state_->may_act(x)) return;
    using Kernel = kernels::PairProduct<Pair, Precision, Space>;
    auto const slots = state_->table.slots(0);
    for_each<Space>("contact_product", pairs().count, Kernel{pairs(), x, p, fixed, slots});
    state_->table.template gather<0>(slots, scale, fixed, hp, hp);
  }

  /// Throws Error, before it writes anything, if the matrix was made when other pairs were
  /// candidates and lacks a block that is not zero: then its pattern must be made anew.
  void add_to(Matrix const& matrix, Positions const& x, double scale, Fixed const& fixed) const {
    if (!state_->may_act(x)) return;
    state_->table.check_pattern(matrix, x, fixed);
    state_->table.assemble(matrix, x, scale, fixed);
  }
  /// The pairs that are candidates now, in memory that lasts until they are asked for again. As
  /// bodies move others become candidates, so a pattern made of them serves for a while only.
  void elements(std::vector<Connectivity>& kinds) const {
    kinds.push_back({state_->table.elements(), 4});
  }

  /// What `bound` certifies for all pairs, no more than `at_most`; 0 if the gap of a pair is nil or
  /// not above round-off. Motion is proved in portions, so that a long one that is soon cut is not
  /// searched to its end; of a step without end (at_most infinite) a finite part.
  double max_step(Positions const& x, Vectors const& p, double at_most) const {
    return state_->max_step(x, p, at_most);
  }
  /// The same: what is pinned may not cross anything either.
  double max_prescribed_step(Positions const& x, Vectors const& p, double at_most) const {
    return state_->max_step(x, p, at_most);
  }
  /// The pair that the last max_step was cut by; none if it was not.
  std::optional<LimitingPair> limiting_pair() const { return state_->limiting_pair(); }

  std::optional<Obstruction> obstruction() const {
    auto const pair = limiting_pair();
    if (!pair) return {};
    bool const points = pair->kind == PairKind::point_triangle;
    return Obstruction{points ? "a point and a triangle that touch" : "two edges that touch",
                       {pair->vertices.begin(), pair->vertices.end()}};
  }

  /// Takes over the stiffness per vertex, for rules that need it; forgets all candidates.
  void begin_step(StepStart<Precision, Space> const& start) const {
    state_->begin_step(start);
    if constexpr (AdaptiveRule<Stiffness_>) {
      auto& table = state_->table;
      if (!table.rule().adapts()) return;
      table.change_rule([](Stiffness_& rule) { rule.reset(); });
      StiffnessBalance const balance =
          balance_of(typename Pair::Barrier(), *this, start, state_->fixed, state_->size);
      table.change_rule([&](Stiffness_& rule) { rule.adapt(balance); });
    }
  }
  /// Grows with each search; x brings the candidates up to date.
  std::int64_t pattern_version(Positions const& x) const {
    // Also where nothing acts yet: it may, before there is another search.
    if (!state_->may_act(x)) state_->table.take(state_->near);
    return state_->near.counters().searches;
  }

  void add_form_shares(Positions const& x, Vectors const& p, double scale, Fixed const& fixed,
                       Array<double, Space> const& shares) const {
    if (!state_->may_act(x)) return;
    using Kernel = kernels::PairFormShares<Pair, Precision, Space>;
    state_->table.template add_form_shares<Kernel>(x, p, scale, fixed, shares);
  }
  /// Joins the bodies of all candidates of the last search, whether they act or not.
  bool link(Fixed const& fixed, typename Bodies<Space>::Indices const& body,
            typename Bodies<Space>::Indices const& label) const {
    if (state_->near.counters().searches == 0) return false;
    state_->table.take(state_->near);
    using Kernel = kernels::LinkPairs<Precision, Space>;
    return maximum<Space>("contact_link", pairs().count, 0, Kernel{pairs(), fixed, body, label}) >
           0;
  }
  void set_idle(IdleMask<Space> const& idle) const { state_->table.set_idle(idle); }
  void mark_acting(Positions const& x, Fixed const& fixed, Array<int, Space> const& marks) const {
    if (!state_->may_act(x)) return;
    using Kernel = kernels::MarkContacts<Precision, Space>;
    for_each<Space>("contact_marks", pairs().count, Kernel{{pairs(), x}, fixed, marks});
  }

  /// For friction: appends all pairs that act at x, with mu by the objects of the surface.
  void lag(Positions const& x, kernels::FrictionMatrix<Space> const& mu,
           LaggedContacts<Precision, Space>& to) const {
    if (!state_->may_act(x)) return;
    using Kernel = kernels::LagPair<Pair, Precision, Space>;
    to.append("contact_lag", pairs().count, Kernel{pairs(), x, state_->surface.object, mu});
  }

  double dhat() const { return state_->activation.dhat; }
  /// For checkpoints: what pairs of two bodies act below, per vertex of the mesh, m.
  Array<double, Space> activation() const { return state_->activation.of_vertex; }
  void set_activation(Array<double, Space> const& of_vertex) const {
    state_->start_gaps.set(of_vertex);
  }
  /// Searches, and the calls that did without: for energies and bounds of short motions, and for
  /// bounds of long ones.
  CacheCounters const& energy_counters() const { return state_->near.counters(); }
  CacheCounters const& bound_counters() const { return state_->swept.counters(); }
  /// What of the former two went through the surface, all of it or around single vertices.
  NeighbourCounters neighbour_counters() const {
    NeighbourCounters sum = state_->near.neighbour_counters();
    NeighbourCounters const& other = state_->swept.neighbour_counters();
    sum.full += other.full;
    sum.partial += other.partial;
    sum.vertices += other.vertices;
    return sum;
  }
  ContactReport report(Positions const& x) const {
    ContactReport r;
    if (!state_->may_act(x)) return r;
    r.candidates = pairs().count;
    r.contacts = state_->table.contacts(x);
    r.smallest_gap = state_->table.smallest_gap(x);
    return r;
  }

private:
  using Table = ContactPairs<Pair, Stiffness_, Precision, Space>;

  struct State {
    Fixed fixed;
    SurfaceViews<Space> surface;
    Activation<Space> activation;
    StartGaps<Search_, Precision> start_gaps;
    Bound_ bound;
    Clearance clearance;
    static constexpr double growth = 4;  ///< of the portions of a motion
    double portion;                      ///< the first of them, m
    // Two, for those of a long motion are many: they would burden every evaluation after it.
    Cache near;            ///< for energies, and for bounds of short motions
    Cache swept;           ///< for bounds of others
    double brief;          ///< motion up to which they are short, m
    double size;           ///< the diagonal of the box around the surface at rest, m
    double swept_for = 0;  ///< motion of its last search, m
    Table table;
    double limit = 0;
    PairKind limiting_kind = PairKind::point_triangle;
    bool limited = false;
    Kokkos::View<int[4], typename Space::memory> limiting{"contact_limiting"};

    State(Unknowns<Precision, Space> const& unknowns, Surface const& host,
          std::vector<Point> const& rest, Params const& params)
        : fixed(unknowns.fixed), bound(params.bound), clearance(params.clearance) {
      if (rest.size() != host.object.size() || rest.size() != std::size_t(unknowns.size())) {
        throw Error(
            "contact: {} positions at rest, a surface over {} vertices and {} unknowns: give as "
            "many of each",
            rest.size(), host.object.size(), unknowns.size());
      }
      EdgeLengths const edges = edge_lengths(host, rest);
      if (!(edges.min > 0)) {
        throw Error("contact: a surface without edges, or with one of length zero: remove it");
      }
      surface = copy_surface<Space>(host);
      portion = edges.mean;
      size = box_diagonal(host, rest);
      double const dhat = params.dhat.value_or(default_dhat(host, rest));
      StartActivation<Space> const start("contact", rest.size(), dhat, params.start_share);
      activation = {dhat, params.cap, copy_points<Space>("contact_rest", rest), surface.object,
                    start.of_vertex()};
      start_gaps = {surface, activation, start, edges.mean, params.search.search};
      clearance.ample = std::min(clearance.ample, activation.dhat);
      near = Cache(surface, edges.mean, activation, params.search);
      brief = std::max(portion, 2 * params.search.slack * activation.dhat);
      typename Cache::Params once = params.search;
      once.skin = 0;  // a long motion is not followed by others like it
      swept = Cache(surface, edges.mean, activation, once);
      table = Table(surface, activation, params.stiffness, params.mollifier_threshold,
                    vertex_areas(host, rest), fixed);
      kernels::check_clearance(clearance, 1);
    }

    /// Makes the table complete for a motion by alpha p; false if nothing acts in it.
    bool may_act(Positions const& x, Vectors const& p = {}, double alpha = 0) {
      if (near.update({x, p, alpha, fixed, true}) == Touch::impossible) return false;
      table.take(near);
      return table.pairs().count > 0;
    }
    void begin_step(StepStart<Precision, Space> const& start) {
      if constexpr (Stiffness_::per_vertex) table.set_vertex_stiffness(start.stiffness);
      // What is fixed may have changed; and candidates that do not depend on steps past make a
      // restarted run go on bitwise.
      near.forget();
      swept.forget();
      start_gaps.begin_step(start.x, fixed);
    }

    double max_step(Positions const& x, Vectors const& p, double at_most) {
      limited = false;
      if (!(at_most > 0)) return at_most;
      using Largest = kernels::LargestMotion<Precision, Space>;
      double const motion =
          2 * maximum<Space>("contact_motion", surface.vertices(), 0.0, Largest{surface.vertex, p});
      if (!std::isfinite(motion)) {
        throw Error("contact: a step by a vector that is not finite: look for what made it");
      }
      if (motion == 0) return at_most;
      // The candidates of a motion much longer than this one would burden the bound as well.
      if (swept_for > growth * std::max(portion, at_most * motion)) swept.forget();
      constexpr double far = 1 << 14;
      // At the start of a step energies need a search through the whole surface: it goes along all
      // of a motion that is not too long, and serves them where that ends.
      bool const anew = !near.known();
      double const first = anew ? growth * portion : portion;
      bool const along = anew && at_most * motion <= first;
      for (double reach = first;; reach *= growth) {
        double const length = std::min(at_most, reach / motion);
        bool const is_brief = anew ? along : length * motion <= brief;
        double const alpha = bounded(is_brief, x, p, length, motion);
        if (alpha < length || length == at_most) return alpha;
        if (!std::isfinite(at_most) && reach >= far * portion) return alpha;
      }
    }

    /// The bound of a step of at most `length`, that is by `length` times `motion` metres.
    double bounded(bool is_brief, Positions const& x, Vectors const& p, double length,
                   double motion) {
      // The candidates of such a motion are no burden to energies, which follow along it.
      if (is_brief) return bounded_within(near, x, p, length);
      std::int64_t const searches = swept.counters().searches;
      double const alpha = bounded_within(swept, x, p, length);
      if (swept.counters().searches > searches) swept_for = length * motion;
      return alpha;
    }
    double bounded_within(Cache& cache, Positions const& x, Vectors const& p, double length) {
      if (cache.update({x, p, length, fixed, true}) == Touch::impossible) return length;
      double const first = bounded_by(cache, cache.candidates().point_triangle, x, p, length);
      return first > 0 ? bounded_by(cache, cache.candidates().edge_edge, x, p, first) : first;
    }
    template <PairKind kind>
    double bounded_by(Cache const& cache, CandidateList<kind, Space> const& list,
                      Positions const& x, Vectors const& p, double length) {
      BoundedStep const step = bound_step<Precision, Space, kind>(
          bound, clearance, PairList<Space>(list.ids()), list.count(), x, p, length,
          cache.template distances<kind>());
      if (step.pair < 0) return length;
      limited = true;
      limit = step.alpha;
      limiting_kind = kind;
      for_each<Space>("contact_limiting", 1,
                      kernels::KeepPair<Space>{list.ids(), step.pair, limiting});
      return step.alpha;
    }
    std::optional<LimitingPair> limiting_pair() const {
      if (!limited) return {};
      auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), limiting);
      return LimitingPair{limiting_kind, {host(0), host(1), host(2), host(3)}, limit};
    }
  };

  kernels::PairTable<Precision, Space> const& pairs() const { return state_->table.pairs(); }

  template <int numbers, class CurvatureField>
  void gradient(Positions const& x, double scale, Fixed const& fixed, Vectors const& g,
                CurvatureField const& c) const {
    if (!state_->may_act(x)) return;
    using Kernel = kernels::PairGradient<Pair, Precision, Space, numbers>;
    auto const slots = state_->table.slots(numbers);
    Kernel const kernel{{pairs(), x, {}, 0, slots}};
    for_each<Space>("contact_gradient", kernel.packs(), kernel);
    state_->table.filled_at(x);
    state_->table.template gather<numbers>(slots, scale, fixed, g, c);
  }
  template <int numbers, class CurvatureField>
  double gradient_after(Positions const& x, Vectors const& p, double alpha, double scale,
                        Fixed const& fixed, Vectors const& g, CurvatureField const& c) const {
    if (!state_->may_act(x, p, -alpha)) return 0;
    using Kernel = kernels::PairGradientAfter<Pair, Precision, Space, numbers>;
    auto const slots = state_->table.slots(numbers);
    Kernel const kernel{{pairs(), x, p, alpha, slots}};
    double const change = state_->table.sum("contact_gradient_after", kernel.packs(), kernel);
    state_->table.filled_at(x);
    state_->table.template gather<numbers>(slots, scale, fixed, g, c);
    return scale * change;
  }

  std::shared_ptr<State> state_;
};

}  // namespace taut
