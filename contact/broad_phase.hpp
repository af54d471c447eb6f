// The search for pairs that may touch: all points and triangles, and all pairs of edges, that come
// closer than a radius, as far as their boxes tell (boxes.hpp). Left out are pairs that share a
// vertex and pairs all of whose vertices are fixed (or only those that are fixed as one).
//
// A `BroadPhase` is a policy that finds the boxes of a set that overlap a given one: SpatialHash,
// Bvh, BruteForce. What is asked of it, in which order, and what becomes of the answers is the same
// for all, and is here: the list of candidates does not depend on the policy. It is sorted by the
// one who asks, then by who is found, so it does not depend on the number of threads either.
//
// Points ask for triangles. Of two edges the one in the smaller size class asks, the first in the
// surface if they are alike. So a floor of two large triangles costs each of its neighbours a step
// and not one thread the whole scene. For this a policy may pass over boxes of a class that is too
// small.
#pragma once

#include <taut/contact/boxes.hpp>
#include <taut/contact/candidates.hpp>

#include <concepts>

namespace taut {

/// A set of boxes that is searched from kernels; copied to the device.
/// `visit(box, least, visitor)` calls `visitor(j)` once for each box j of the set that overlaps
/// `box` and is in the size class `least` or above, in any order; it may show smaller ones too.
template <class I>
concept BoxIndex = requires(I const& index, SearchBox const& box, SizeClass least,
                            void (*visitor)(int)) {
  {index.visit(box, least, visitor)};
};

/// A way to find the boxes that overlap: constructed for up to `count` boxes, most of which have
/// sides of about `length` (m).
template <class B>
concept BroadPhase = std::constructible_from<B, typename B::Params, int, double> &&
    requires(B& search, BoxSet<typename B::Space> const& boxes) {
  /// Takes up other boxes; those of the last time may have become others.
  {search.build(boxes)};
  { search.index() } -> BoxIndex;
};

/// Compares all with all: what the others are measured by.
template <class S = DefaultSpace>
class BruteForce {
public:
  using Space = S;
  struct Params {};
  struct Index {
    Kokkos::View<SearchBox const*, typename S::memory> box;
    int count;

    template <class Visitor>
    KOKKOS_FUNCTION void visit(SearchBox const& query, SizeClass, Visitor&& visitor) const {
      for (int j = 0; j < count; ++j) {
        if (overlap(query, box(j))) visitor(j);
      }
    }
  };

  BruteForce() = default;
  BruteForce(Params const&, int, double) {}
  void build(BoxSet<S> const& boxes) { boxes_ = boxes; }
  Index index() const { return {boxes_.box, boxes_.count}; }

private:
  BoxSet<S> boxes_;
};

namespace kernels {

/// Which pairs are of no interest because all four vertices are fixed.
template <class S>
struct Held {
  FixedMask<S> fixed;  ///< empty: none is
  bool together;       ///< only those that are fixed by one mark

  KOKKOS_INLINE_FUNCTION bool operator()(int const (&v)[4]) const {
    if (fixed.extent(0) == 0) return false;
    std::uint8_t const mark = fixed(v[0]);
    for (int a = 0; a < 4; ++a) {
      if (fixed(v[a]) == 0 || (together && fixed(v[a]) != mark)) return false;
    }
    return true;
  }
};

/// Of what pairs are made. `vertices(i, j, v)` are those of the pair that box i of those that ask
/// and box j of those that are asked for make; `accept(i, j)` says whether it is one.
template <class S>
struct PairPointTriangle {
  static constexpr PairKind kind = PairKind::point_triangle;
  SurfaceViews<S> surface;
  Held<S> held;

  KOKKOS_FUNCTION SizeClass least(int) const { return smallest_class; }
  KOKKOS_FUNCTION void vertices(int i, int j, int (&v)[4]) const {
    v[0] = surface.vertex(i);
    for (int a = 0; a < 3; ++a) v[1 + a] = surface.triangle(3 * j + a);
  }
  KOKKOS_FUNCTION bool accept(int i, int j) const {
    int v[4];
    vertices(i, j, v);
    return v[0] != v[1] && v[0] != v[2] && v[0] != v[3] && !held(v);
  }
};

template <class S>
struct PairEdgeEdge {
  static constexpr PairKind kind = PairKind::edge_edge;
  SurfaceViews<S> surface;
  Held<S> held;
  Kokkos::View<SearchBox const*, typename S::memory> box;

  KOKKOS_FUNCTION SizeClass least(int i) const { return size_class(longest_side(box(i))); }
  KOKKOS_FUNCTION void vertices(int i, int j, int (&v)[4]) const {
    int const first = Kokkos::min(i, j), second = Kokkos::max(i, j);
    for (int a = 0; a < 2; ++a) {
      v[a] = surface.edge(2 * first + a);
      v[2 + a] = surface.edge(2 * second + a);
    }
  }
  KOKKOS_FUNCTION bool accept(int i, int j) const {
    SizeClass const class_i = least(i), class_j = least(j);
    if (class_i != class_j ? class_i > class_j : i >= j) return false;
    int v[4];
    vertices(i, j, v);
    bool const shared = v[0] == v[2] || v[0] == v[3] || v[1] == v[2] || v[1] == v[3];
    return !shared && !held(v);
  }
};

/// How many pairs box i makes.
template <class S, class Index, class Pairing>
struct CountPairs {
  Index index;
  Pairing pairing;
  Kokkos::View<SearchBox const*, typename S::memory> box;
  Kokkos::View<std::int64_t*, typename S::memory> begin;

  struct Visitor {
    Pairing const& pairing;
    int i;
    std::int64_t count = 0;
    KOKKOS_FUNCTION void operator()(int j) {
      if (pairing.accept(i, j)) ++count;
    }
  };
  KOKKOS_FUNCTION void operator()(int i) const {
    Visitor visitor{pairing, i};
    index.visit(box(i), pairing.least(i), visitor);
    begin(i) = visitor.count;
  }
};

/// Writes the pairs of box i, by ascending partner.
template <class S, class Index, class Pairing>
struct FillPairs {
  Index index;
  Pairing pairing;
  Kokkos::View<SearchBox const*, typename S::memory> box;
  Kokkos::View<std::int64_t const*, typename S::memory> begin;
  PairIds<S> ids;

  struct Visitor {
    Pairing const& pairing;
    PairIds<S> const& ids;
    int i;
    std::int64_t end;
    KOKKOS_FUNCTION void operator()(int j) {
      if (pairing.accept(i, j)) ids(end++, 0) = j;
    }
  };
  KOKKOS_FUNCTION void operator()(int i) const {
    // The pairs hold the partners alone until these are sorted.
    std::int64_t const first = begin(i);
    Visitor visitor{pairing, ids, i, first};
    index.visit(box(i), pairing.least(i), visitor);
    sort(first, visitor.end);
    for (std::int64_t k = first; k < visitor.end; ++k) {
      int v[4];
      pairing.vertices(i, ids(k, 0), v);
      write_pair(v, ids, k);
    }
  }
  /// Shell's sort with Knuth's gaps (The Art of Computer Programming 3, section 5.2.1): in place,
  /// and for the few partners that there are mostly, an insertion sort.
  KOKKOS_FUNCTION void sort(std::int64_t first, std::int64_t last) const {
    std::int64_t gap = 1;
    while (gap < (last - first) / 9) gap = 3 * gap + 1;
    for (; gap > 0; gap /= 3) {
      for (std::int64_t k = first + gap; k < last; ++k) {
        int const j = ids(k, 0);
        std::int64_t to = k;
        for (; to - gap >= first && ids(to - gap, 0) > j; to -= gap) ids(to, 0) = ids(to - gap, 0);
        ids(to, 0) = j;
      }
    }
  }
};

}  // namespace kernels

/// Searches one surface, again and again. Owns its memory: it allocates only when a list of
/// candidates grows.
template <BroadPhase Policy>
class PairSearch {
public:
  using Space = typename Policy::Space;
  using Params = typename Policy::Params;

  PairSearch() = default;
  /// `edge_length`: mean length of the surface's edges, m.
  PairSearch(SurfaceViews<Space> const& surface, double edge_length, Params const& params = {})
      : boxes_(surface),
        triangles_(params, surface.triangles(), edge_length),
        edges_(params, surface.edges(), edge_length),
        begin_("candidate_begin", std::max(surface.vertices(), surface.edges())) {}

  /// All pairs that come closer than `radius` (m) during the motion, and some that do not. Throws
  /// Error for places that are not finite, and for more pairs than an int can count.
  template <class Precision>
  void find(Motion<Precision, Space> const& motion, double radius, Candidates<Space>& found) {
    boxes_.compute(motion, radius);
    triangles_.build(boxes_.triangles());
    edges_.build(boxes_.edges());
    SurfaceViews<Space> const& surface = boxes_.surface();
    kernels::Held<Space> const held{motion.fixed, motion.between_fixed};
    ask(boxes_.points(), triangles_.index(), kernels::PairPointTriangle<Space>{surface, held},
        found.point_triangle);
    ask(boxes_.edges(), edges_.index(),
        kernels::PairEdgeEdge<Space>{surface, held, boxes_.edges().box}, found.edge_edge);
  }

  SurfaceViews<Space> const& surface() const { return boxes_.surface(); }

private:
  template <class Index, class Pairing>
  void ask(BoxSet<Space> const& by, Index const& index, Pairing const& pairing,
           CandidateList<Pairing::kind, Space>& found) const {
    using Count = kernels::CountPairs<Space, Index, Pairing>;
    using Fill = kernels::FillPairs<Space, Index, Pairing>;
    Kokkos::View<std::int64_t*, typename Space::memory> const begin(begin_,
                                                                    Kokkos::make_pair(0, by.count));
    for_each<Space>("candidates_count", by.count, Count{index, pairing, by.box, begin});
    found.resize(exclusive_scan<Space, std::int64_t>("candidates_begin", begin));
    for_each<Space>("candidates_fill", by.count, Fill{index, pairing, by.box, begin, found.ids()});
  }

  SurfaceBoxes<Space> boxes_;
  Policy triangles_, edges_;
  Kokkos::View<std::int64_t*, typename Space::memory> begin_;
};

}  // namespace taut
