// Pairs that are near each other, kept up to date vertex by vertex: what candidates are chosen
// from, so that few of them need a search through the whole surface.
//
// A search anchors the vertices. From then on vertex i counts as being at
//
//   A_i + s P_i + c,   give or take r_i,
//
// A where it was, P the motion that it was to make, s from 0 to 1 how far that has gone, and c any
// translation, the same for all: what a scene does as a whole costs nothing. The list holds the
// pairs of which
//
//   d(A) < a + reach + |P_i - P_j| + r_i + r_j,
//
// a the distance below which the pair is looked after (candidate_cache.hpp) and |P_i - P_j| how far
// it goes against itself. So it has all that come closer than a + reach, as long as each vertex
// keeps to its r. A vertex that does not is anchored anew, by itself, where it is: the pairs of its
// primitives are dropped from the list, and these search again. In a pile most vertices move little
// while a few move far, so such a search is for few.
//
// Once a part s of a motion by more than an edge has been gone, all are anchored where they are on
// it, A + s P, without a path, and what was near on the way alone is dropped from the list. Shorter
// ones are kept: the next motion is often the same in part.
#pragma once

#include <taut/contact/neighbour_kernels.hpp>

namespace taut {

/// Pairs of primitives of one kind, with what a filter has noted of them.
template <PairKind kind, class S>
class NeighbourList {
public:
  int count() const { return count_; }
  kernels::KnownPrimitives<kind, S> pairs(SurfaceViews<S> const& surface) const {
    return {{surface, pairs_}, notes_};
  }

  void clear() { count_ = 0; }
  /// Drops the pairs that have a stray vertex.
  void drop(SurfaceViews<S> const& surface, VertexMask<S> const& stray) {
    grow(place_, "neighbour_place", count_);
    for_each<S>("neighbours_drop", count_,
                kernels::KeepsAnchors<kind, S>{{surface, pairs_}, stray, place_});
    compact(pairs_, notes_, 0, count_);
  }
  /// Keeps those that the filter keeps.
  template <class Filter, class Positions>
  void keep(SurfaceViews<S> const& surface, Filter const& filter, Positions const& x) {
    std::swap(pairs_, found_);
    append(std::exchange(count_, 0), surface, filter, x);
  }
  /// Makes room for `n` pairs that are to be judged.
  kernels::WritePrimitives<S> room(std::int64_t n) {
    refuse_pairs_beyond(std::numeric_limits<int>::max() / 2, n + count_);
    grow(found_, "neighbours_found", static_cast<std::size_t>(n));
    return {found_};
  }
  /// Appends those of `n` pairs in that room that the filter keeps.
  template <class Filter, class Positions>
  void append(int n, SurfaceViews<S> const& surface, Filter const& filter, Positions const& x) {
    using Source = kernels::FoundPrimitives<kind, S>;
    grow(place_, "neighbour_place", n);
    judged_.make_room(n);
    kernels::JudgePairs<kind, S, Source, Positions, Filter> const judge{
        {surface, found_}, x, filter, n, place_, judged_};
    for_each<S>("neighbours_judge", judge.packs(), judge);
    compact(found_, judged_, count_, n);
  }

private:
  /// Leaves the first pairs of the list, and after them those of `from` that are marked in place_.
  void compact(PrimitivePairs<S> const& from, kernels::NoteFields<S> const& notes, int first,
               int count) {
    Kokkos::View<int*, typename S::memory> const place(place_, Kokkos::make_pair(0, count));
    int const kept = exclusive_scan<S, int>("neighbours_place", place);
    bool const in_place = first > 0 && pairs_.extent_int(0) >= first + kept &&
                          notes_.distance.extent_int(0) >= first + kept;
    PrimitivePairs<S> to = in_place ? pairs_ : spare_;
    kernels::NoteFields<S> notes_to = in_place ? notes_ : spare_notes_;
    if (!in_place) {
      grow(to, "neighbours", first + kept);
      notes_to.make_room(first + kept);
      copy_front<S>(pairs_, to, first);
      copy_front<S>(notes_.distance, notes_to.distance, first);
      copy_front<S>(notes_.activation, notes_to.activation, first);
    }
    for_each<S>("neighbours_move", count,
                kernels::MovePrimitives<S>{from, to, notes, notes_to, place, first, count, kept});
    if (!in_place) {
      spare_ = std::exchange(pairs_, to);
      spare_notes_ = std::exchange(notes_, notes_to);
    }
    count_ = first + kept;
  }

  PrimitivePairs<S> pairs_, spare_, found_;
  kernels::NoteFields<S> notes_, spare_notes_, judged_;
  Kokkos::View<int*, typename S::memory> place_;
  int count_ = 0;
};

/// Who leads a motion that is followed: a vertex that goes as far as any, and how far.
struct Lead {
  int vertex = -1;    ///< -1: nobody; it is not followed
  double length = 0;  ///< m
};

struct NeighbourCounters {
  std::int64_t full = 0;      ///< searches of all primitives
  std::int64_t partial = 0;   ///< searches of those with stray vertices
  std::int64_t vertices = 0;  ///< stray vertices in the latter
};

/// Owns its memory: it allocates only when a list grows.
template <BroadPhase Policy, class Precision>
class Neighbours {
public:
  using Space = typename Policy::Space;
  template <PairKind kind>
  using Pairs = kernels::KnownPrimitives<kind, Space>;

  Neighbours() = default;
  /// `edge_length`: mean length of the surface's edges; `skin`: what two vertices may move against
  /// each other before one of them is searched for again; m.
  Neighbours(SurfaceViews<Space> const& surface, double edge_length, double skin,
             typename Policy::Params const& params)
      : boxes_(surface, edge_length),
        points_(params, surface.vertices(), edge_length),
        edges_(params, surface.edges(), edge_length),
        triangles_(params, surface.triangles(), edge_length),
        inquiry_(std::max({surface.vertices(), surface.edges(), surface.triangles()})),
        least_radius_(skin / 2),
        long_path_(edge_length),
        reducer_(surface.vertices(), 6),
        stray_("neighbour_stray", surface.object.extent(0)),
        place_("neighbour_asks", std::max(surface.edges(), surface.triangles())),
        asks_("neighbour_asks", place_.extent(0)) {
    std::size_t const n = surface.object.extent(0);
    anchors_.at = make_departure<Space>(n);
    anchors_.radius = Array<double, Space>("neighbour_radius", n);
  }

  /// Makes the list hold all pairs that `near` keeps, whose motion is followed if somebody leads
  /// it; `reach`: no less, m, if it searches through the whole surface. Throws Error for places
  /// that are not finite, and for more pairs than an int can count.
  void update(kernels::WithinReach<Precision, Space> const& near, Lead const& lead, double reach) {
    auto const& motion = near.motion;
    int const n = surface().vertices();
    if (n == 0) return;
    bool const holds = known_ && found_for(motion) && near.reach.within <= reach_.within &&
                       near.reach.between <= reach_.between;
    if (holds) {
      Seen seen = look(motion);
      if (seen.s[0] > 0 && lead_.length > long_path_) {
        settle(near, seen.s[0]);
        seen = look(motion);
      }
      kernels::FindStrays<Precision, Space> const find{surface(), seen, anchors_.radius,
                                                       least_radius_, stray_};
      int const strays = join_all<Space>("neighbour_strays", n, find);
      if (strays == 0) return;
      if (strays <= n / 4) {
        known_ = false;  // should a search throw
        for_each<Space>("neighbour_anchors", n,
                        kernels::AnchorStrays<Precision, Space>{surface(), seen, least_radius_,
                                                                stray_, anchors_});
        ++counters_.partial;
        counters_.vertices += strays;
        search_strays(near);
        known_ = true;
        return;
      }
    }
    known_ = false;
    ++counters_.full;
    reach_ = {std::max(near.reach.within, reach), std::max(near.reach.between, reach)};
    lead_ = lead;
    anchors_.at.leader = lead.vertex;
    for_each<Space>("neighbour_anchors", n,
                    kernels::AnchorAll<Precision, Space>{
                        surface(), {motion, anchors_.at}, least_radius_, anchors_});
    if (lead.vertex >= 0) {
      for_each<Space>("neighbour_lead", 3, kernels::KeepLead<Space>{anchors_.at});
    }
    search_all(near);
    remember(motion);
  }
  bool known() const { return known_; }
  /// Makes the next update search through the whole surface.
  void forget() { known_ = false; }

  template <PairKind kind>
  int count() const {
    return list<kind>(*this).count();
  }
  template <PairKind kind>
  Pairs<kind> pairs() const {
    return list<kind>(*this).pairs(surface());
  }
  SurfaceViews<Space> const& surface() const { return boxes_.surface(); }
  NeighbourCounters const& counters() const { return counters_; }

private:
  using Seen = kernels::SeenFromAnchors<Precision, Space>;
  using Indices = Kokkos::View<int*, typename Space::memory>;
  static constexpr PairKind point_triangle = PairKind::point_triangle,
                            edge_edge = PairKind::edge_edge;

  template <PairKind kind, class Self>
  static auto& list(Self& self) {
    if constexpr (kind == point_triangle) {
      return self.point_triangle_;
    } else {
      return self.edge_edge_;
    }
  }

  bool found_for(Motion<Precision, Space> const& motion) const {
    if (motion.between_fixed != between_fixed_) return false;
    int const n = motion.fixed.extent_int(0);
    return n == fixed_.extent_int(0) &&
           minimum<Space>("neighbour_marks", n, n,
                          kernels::FindOtherMark<Space>{motion.fixed, fixed_}) == n;
  }
  void remember(Motion<Precision, Space> const& motion) {
    if (fixed_.extent(0) != motion.fixed.extent(0)) {
      fixed_ = FixedMask<Space>("neighbour_fixed", motion.fixed.extent(0));
    }
    assign_on<Space>(fixed_, motion.fixed);
    between_fixed_ = motion.between_fixed;
    known_ = true;
  }

  Seen look(Motion<Precision, Space> const& motion) const {
    kernels::MotionSince<Precision, Space> const since{motion, anchors_.at};
    Seen seen{since, {}, {}};
    kernels::Progress const progress =
        join_all<Space>("neighbour_progress", 1, kernels::FindProgress<Precision, Space>{since});
    seen.s[0] = progress.start;
    seen.s[1] = progress.end;
    int const n = surface().vertices();
    auto const sum = reducer_.template sum<6>(
        "neighbour_drift", n,
        kernels::SumDrift<Precision, Space>{surface(), since, {seen.s[0], seen.s[1]}});
    for (int end = 0; end < 2; ++end)
      for (int c = 0; c < 3; ++c) seen.drift[end][c] = sum[3 * end + c] / n;
    return seen;
  }

  kernels::NearAnchors<Space> filter(kernels::WithinReach<Precision, Space> const& near) const {
    return {{near.activation, reach_, anchors_.motion()}, anchors_.radius};
  }
  /// Anchors all where they are on their path, and drops the pairs that were near on it alone.
  void settle(kernels::WithinReach<Precision, Space> const& near, double s) {
    for_each<Space>("neighbour_anchors", surface().vertices(),
                    kernels::SettleAnchors<Space>{surface(), s, anchors_});
    anchors_.at.leader = -1;
    lead_ = {};
    settled_ = true;
    point_triangle_.keep(surface(), filter(near), anchors_.at.from);
    edge_edge_.keep(surface(), filter(near), anchors_.at.from);
  }
  /// Boxes around the anchors; of the others they have not changed, if `only` some are named.
  void compute_boxes(kernels::WithinReach<Precision, Space> const& near,
                     VertexMask<Space> const& only = {}) {
    double const reach = std::max(reach_.within, reach_.between);
    Motion<Fp64, Space> at_anchors = anchors_.motion();
    at_anchors.fixed = near.motion.fixed;
    at_anchors.between_fixed = near.motion.between_fixed;
    boxes_.compute(at_anchors, near.activation.dhat + reach, anchors_.radius,
                   settled_ ? VertexMask<Space>() : only);
    settled_ = false;
    triangles_.build(boxes_.triangles());
    edges_.build(boxes_.edges());
  }

  void search_all(kernels::WithinReach<Precision, Space> const& near) {
    compute_boxes(near);
    kernels::Held<Space> const held{near.motion.fixed, near.motion.between_fixed};
    point_triangle_.clear();
    edge_edge_.clear();
    ask(near, {boxes_.points().box, boxes_.points().count}, triangles_.index(),
        kernels::PairPointTriangle<Space>{{surface(), held}});
    ask(near, {boxes_.edges().box, boxes_.edges().count}, edges_.index(),
        kernels::PairEdgeEdge<Space>{{surface(), held}, boxes_.edges().rank});
  }

  void search_strays(kernels::WithinReach<Precision, Space> const& near) {
    compute_boxes(near, stray_);
    points_.build(boxes_.points());
    kernels::Held<Space> const held{near.motion.fixed, near.motion.between_fixed};
    point_triangle_.drop(surface(), stray_);
    edge_edge_.drop(surface(), stray_);
    kernels::HasVertexIn<Space, 1> const point{surface().vertex, stray_};
    kernels::HasVertexIn<Space, 2> const edge{surface().edge, stray_};
    kernels::HasVertexIn<Space, 3> const triangle{surface().triangle, stray_};
    ask(near, askers(boxes_.points(), point), triangles_.index(),
        kernels::PairPointTriangle<Space>{{surface(), held}});
    ask(near, askers(boxes_.triangles(), triangle), points_.index(),
        kernels::PairTrianglePoint<Space>{{surface(), held}, point});
    ask(near, askers(boxes_.edges(), edge), edges_.index(),
        kernels::PairEdgeAnew<Space>{{surface(), held}, edge});
  }
  template <class Chosen>
  kernels::Askers<Space> askers(BoxSet<Space> const& boxes, Chosen const& chosen) const {
    Indices const place(place_, Kokkos::make_pair(0, boxes.count));
    int const n = exclusive_scan<Space, int>("neighbour_asks", boxes.count, chosen, place);
    for_each<Space>("neighbour_asks", boxes.count,
                    kernels::ListChosen<Space, Chosen>{chosen, place, asks_});
    return {boxes.box, n, Indices(asks_, Kokkos::make_pair(0, n))};
  }
  template <class Index, class Pairing>
  void ask(kernels::WithinReach<Precision, Space> const& near, kernels::Askers<Space> const& by,
           Index const& index, Pairing const& pairing) {
    if (by.count == 0) return;
    auto& found = list<Pairing::kind>(*this);
    std::int64_t const n =
        inquiry_.ask(by, index, pairing, [&](std::int64_t room) { return found.room(room); });
    found.append(static_cast<int>(n), surface(), filter(near), anchors_.at.from);
  }

  SurfaceBoxes<Space> boxes_;
  Policy points_, edges_, triangles_;
  BoxInquiry<Space> inquiry_;
  double least_radius_ = 0, long_path_ = 0;
  Lead lead_;
  Displacement reach_;
  kernels::Anchors<Space> anchors_;
  Reducer<Space, double> reducer_;
  Kokkos::View<std::uint8_t*, typename Space::memory> stray_;  ///< per vertex of the mesh
  Indices place_, asks_;
  NeighbourList<point_triangle, Space> point_triangle_;
  NeighbourList<edge_edge, Space> edge_edge_;
  bool known_ = false, between_fixed_ = false;
  bool settled_ = false;  ///< all anchors have moved since boxes were made
  FixedMask<Space> fixed_;
  NeighbourCounters counters_;
};

}  // namespace taut
