// The search for pairs that may touch: all points and triangles, and all pairs of edges, that come
// closer than a radius, as far as their boxes tell (boxes.hpp). Left out are pairs that share a
// vertex and pairs all of whose vertices are fixed (or only those that are fixed as one).
//
// A `BroadPhase` is a policy that finds the boxes of a set that overlap a given one: SpatialHash,
// Bvh, BruteForce. What is asked of it, in which order, and what becomes of the answers is the same
// for all, and is here: the list of candidates does not depend on the policy. It is sorted by the
// one who asks, then by who is found, so it does not depend on the number of threads either.
//
// Points ask for triangles. Of two edges the one of lower rank asks (boxes.hpp); for this a policy
// may pass over boxes whose rank is too low.
#pragma once

#include <taut/contact/boxes.hpp>
#include <taut/contact/candidates.hpp>
#include <taut/core/math/bits.hpp>

#include <concepts>

namespace taut {

/// Boxes that are neighbours ask together, up to eight of them.
struct QueryGroup {
  static constexpr int most = 8;
  int count = 0;
  SearchBox box[most];
  Rank least[most];
};

/// A set of boxes that is searched from kernels; copied to the device.
/// `visit(box, least, visitor)` calls `visitor(j)` once for each box j of the set that overlaps
/// `box` and is of the rank `least` or above, in any order; it may show lower ones too.
/// A GroupIndex also has `visit_group(group, visitor)`, which goes through the set once for a group
/// of boxes and calls `visitor(bits, j)`, with bit a for box a of the group: once for each a and j,
/// several a in a call.
template <class I>
concept BoxIndex = requires(I const& index, SearchBox const& box, Rank least,
                            void (*visitor)(int)) {
  {index.visit(box, least, visitor)};
};

template <class I>
concept GroupIndex = BoxIndex<I> &&
    requires(I const& index, QueryGroup const& group, void (*visitor)(unsigned, int)) {
  {index.visit_group(group, visitor)};
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
    KOKKOS_FUNCTION void visit(SearchBox const& query, Rank, Visitor&& visitor) const {
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

  /// Of a pair, or of some of its vertices: false if others cannot make it true.
  template <int n>
  KOKKOS_INLINE_FUNCTION bool operator()(int const (&v)[n]) const {
    if (fixed.extent(0) == 0) return false;
    std::uint8_t const mark = fixed(v[0]);
    for (int a = 0; a < n; ++a) {
      if (fixed(v[a]) == 0 || (together && fixed(v[a]) != mark)) return false;
    }
    return true;
  }
};

/// The vertices of points (one), edges (two) or triangles (three) of a surface.
template <int corners, class S>
KOKKOS_FUNCTION typename SurfaceViews<S>::Indices const& corners_of(
    SurfaceViews<S> const& surface) {
  if constexpr (corners == 1) {
    return surface.vertex;
  } else if constexpr (corners == 2) {
    return surface.edge;
  } else {
    return surface.triangle;
  }
}

/// The vertices of a pair of primitives, as `PairIds` has them: of a point and a triangle of the
/// surface, or of two of its edges.
template <PairKind kind, class S>
KOKKOS_FUNCTION void vertices_of(SurfaceViews<S> const& surface, int first, int second,
                                 int (&v)[4]) {
  constexpr int corners = kind == PairKind::point_triangle ? 1 : 2;
  for (int a = 0; a < corners; ++a) v[a] = corners_of<corners>(surface)(corners * first + a);
  for (int a = corners; a < 4; ++a) {
    v[a] = corners_of<4 - corners>(surface)((4 - corners) * second + a - corners);
  }
}

/// Up to n primitives that ask together, side by side.
template <int corners, int n>
struct AskingGroup {
  int index[n] = {}, vertex[corners][n] = {};
  Rank least[n] = {};
};

/// Of what pairs are made: of primitives that ask and have `corners` vertices, and others that they
/// ask for. `accept(group, bits, j)` says which of the group, of those that `bits` names, make a
/// pair with primitive j; then `order(i, j, ij)` are the two in their order. This is what all
/// pairings share.
template <int corners, class S>
struct PairingBase {
  static constexpr PairKind kind = corners == 2 ? PairKind::edge_edge : PairKind::point_triangle;
  static constexpr int others = 4 - corners;  ///< vertices of what is asked for
  template <int n>
  using Group = AskingGroup<corners, n>;
  SurfaceViews<S> surface;
  Held<S> held;

  KOKKOS_FUNCTION Rank least(int) const { return lowest_rank; }
  KOKKOS_FUNCTION void order(int i, int j, int (&ij)[2]) const {
    bool const in_order = corners == 1 || (corners == 2 && i < j);
    ij[0] = in_order ? i : j, ij[1] = in_order ? j : i;
  }

protected:
  /// Of the group, those that share no vertex with primitive j, and are not held with it.
  template <int n>
  KOKKOS_FUNCTION unsigned pairs(Group<n> const& group, unsigned bits, int j) const {
    int of_j[others];
    for (int c = 0; c < others; ++c) of_j[c] = corners_of<others>(surface)(others * j + c);
    bits &= bits_where<n>([&](int b) {
      bool apart = true;
      for (int a = 0; a < corners; ++a)
        for (int c = 0; c < others; ++c) apart &= group.vertex[a][b] != of_j[c];
      return apart;
    });
    if (!held(of_j)) return bits;
    for (unsigned rest = bits; rest != 0; rest &= rest - 1) {
      int const b = lowest_bit(rest);
      int v[4];
      for (int a = 0; a < corners; ++a) v[a] = group.vertex[a][b];
      for (int c = 0; c < others; ++c) v[corners + c] = of_j[c];
      if (held(v)) bits &= ~(1u << b);
    }
    return bits;
  }
};

template <class S>
struct PairPointTriangle : PairingBase<1, S> {
  template <int n>
  KOKKOS_FUNCTION unsigned accept(AskingGroup<1, n> const& group, unsigned bits, int j) const {
    return this->pairs(group, bits, j);
  }
};

/// Of two edges the one of lower rank asks.
template <class S>
struct PairEdgeEdge : PairingBase<2, S> {
  Kokkos::View<Rank const*, typename S::memory> rank;

  KOKKOS_FUNCTION Rank least(int i) const { return rank(i); }
  template <int n>
  KOKKOS_FUNCTION unsigned accept(AskingGroup<2, n> const& group, unsigned bits, int j) const {
    Rank const of_j = rank(j);
    bits &= bits_where<n>([&](int b) { return group.least[b] < of_j; });
    return bits == 0 ? 0 : this->pairs(group, bits, j);
  }
};

/// Where pairs are written to as the vertices of each.
template <class S>
struct WriteVertices {
  SurfaceViews<S> surface;
  PairIds<S> ids;

  /// Keeps the partner of pair k until it is written.
  KOKKOS_FUNCTION int& partner(std::int64_t k) const { return ids(k, 0); }
  template <class Pairing>
  KOKKOS_FUNCTION void operator()(Pairing const& pairing, int i, int j, std::int64_t k) const {
    int ij[2], v[4];
    pairing.order(i, j, ij);
    vertices_of<Pairing::kind>(surface, ij[0], ij[1], v);
    write_pair(v, ids, k);
  }
};

/// Partners of a box that are kept until the lists have their places.
inline constexpr int noted_partners = 32;
/// Where those of asker a are.
KOKKOS_INLINE_FUNCTION std::int64_t first_noted(int a) { return std::int64_t{noted_partners} * a; }

/// Boxes that ask: those named, or if none is, the first `count`.
template <class S>
struct Askers {
  Kokkos::View<SearchBox const*, typename S::memory> box;
  int count;
  Kokkos::View<int const*, typename S::memory> name = {};
  KOKKOS_FUNCTION int operator()(int k) const { return name.extent(0) > 0 ? name(k) : k; }
};

/// Makes primitive i the one of place a in a group.
template <class Pairing, int corners, int n>
KOKKOS_FUNCTION void take_in(Pairing const& pairing, int i, AskingGroup<corners, n>& group, int a) {
  group.index[a] = i;
  for (int c = 0; c < corners; ++c) {
    group.vertex[c][a] = corners_of<corners>(pairing.surface)(corners * i + c);
  }
  group.least[a] = pairing.least(i);
}

/// What a group of boxes finds: how many partners each has, and the first few of them.
template <class S, class Index, class Pairing>
struct FindPairs {
  /// On a device each box asks by itself: there the threads are what counts.
  static constexpr int group = S::on_host ? QueryGroup::most : 1;

  Index index;
  Pairing pairing;
  Askers<S> by;
  Kokkos::View<std::int64_t*, typename S::memory> count;
  Kokkos::View<int*, typename S::memory> partner;  ///< noted_partners a + k of asker a

  struct Visitor {
    FindPairs const& find;
    int first;
    typename Pairing::template Group<group> askers = {};
    int count[group] = {};
    KOKKOS_FUNCTION void operator()(unsigned asking, int j) {
      unsigned rest = find.pairing.accept(askers, asking, j);
      for (; rest != 0; rest &= rest - 1) {
        int const a = lowest_bit(rest);
        if (count[a] < noted_partners) find.partner(first_noted(first + a) + count[a]) = j;
        ++count[a];
      }
    }
  };
  /// Of an index that takes single boxes.
  struct One {
    Visitor& visitor;
    unsigned bit;
    KOKKOS_FUNCTION void operator()(int j) { visitor(bit, j); }
  };
  KOKKOS_FUNCTION void operator()(int g) const {
    Visitor visitor{*this, group * g};
    int const left = by.count - group * g, n = left < group ? left : int(group);
    for (int a = 0; a < n; ++a) take_in(pairing, by(group * g + a), visitor.askers, a);
    if constexpr (group > 1 && GroupIndex<Index>) {
      QueryGroup query{n, {}, {}};
      for (int a = 0; a < n; ++a) {
        int const i = by(group * g + a);
        query.box[a] = by.box(i);
        query.least[a] = visitor.askers.least[a];
      }
      index.visit_group(query, visitor);
    } else {
      for (int a = 0; a < n; ++a) {
        int const i = by(group * g + a);
        index.visit(by.box(i), visitor.askers.least[a], One{visitor, 1u << a});
      }
    }
    for (int a = 0; a < n; ++a) count(group * g + a) = visitor.count[a];
  }
};

/// Writes the pairs of asker a, by ascending partner.
template <class S, class Index, class Pairing, class Writer>
struct FillPairs {
  FindPairs<S, Index, Pairing> find;  ///< `count` is now where the pairs of a box begin
  std::int64_t total;
  Writer writer;

  /// For a box with more partners than were noted.
  struct Visitor {
    FillPairs const& fill;
    std::int64_t end;
    typename Pairing::template Group<1> asker = {};
    KOKKOS_FUNCTION void operator()(int j) {
      if (fill.find.pairing.accept(asker, 1u, j) != 0) fill.writer.partner(end++) = j;
    }
  };
  KOKKOS_FUNCTION void operator()(int a) const {
    std::int64_t const first = find.count(a),
                       last = a + 1 < find.by.count ? find.count(a + 1) : total;
    if (last - first <= noted_partners) {
      write_noted(a, first, static_cast<int>(last - first));
    } else {
      int const i = find.by(a);
      // The pairs hold the partners alone until these are sorted.
      Visitor visitor{*this, first};
      take_in(find.pairing, i, visitor.asker, 0);
      find.index.visit(find.by.box(i), visitor.asker.least[0], visitor);
      sort(first, last);
      for (std::int64_t k = first; k < last; ++k) writer(find.pairing, i, writer.partner(k), k);
    }
  }

private:
  /// Each has its place by how many are less: without branches, and side by side on the host.
  KOKKOS_FUNCTION void write_noted(int a, std::int64_t first, int count) const {
    int partner[noted_partners], less[noted_partners] = {};
    for (int k = 0; k < noted_partners; ++k) {
      partner[k] = k < count ? find.partner(first_noted(a) + k) : 0;
    }
    for (int m = 0; m < count; ++m)
      for (int k = 0; k < noted_partners; ++k) less[k] += partner[m] < partner[k] ? 1 : 0;
    int const i = find.by(a);
    for (int k = 0; k < count; ++k) writer(find.pairing, i, partner[k], first + less[k]);
  }
  /// Shell's sort with Knuth's gaps (The Art of Computer Programming 3, section 5.2.1): in place,
  /// and for the few partners that there are mostly, an insertion sort.
  KOKKOS_FUNCTION void sort(std::int64_t first, std::int64_t last) const {
    std::int64_t gap = 1;
    while (gap < (last - first) / 9) gap = 3 * gap + 1;
    for (; gap > 0; gap /= 3) {
      for (std::int64_t k = first + gap; k < last; ++k) {
        int const j = writer.partner(k);
        std::int64_t to = k;
        for (; to - gap >= first && writer.partner(to - gap) > j; to -= gap) {
          writer.partner(to) = writer.partner(to - gap);
        }
        writer.partner(to) = j;
      }
    }
  }
};

}  // namespace kernels

/// Lets boxes ask for those that they overlap. Owns the memory that this takes.
template <class S>
class BoxInquiry {
public:
  BoxInquiry() = default;
  explicit BoxInquiry(int most_askers)
      : begin_("candidate_begin", most_askers),
        partner_("candidate_partner", kernels::noted_partners * begin_.extent(0)) {}

  /// Writes the pairs that `by` makes with what is in `index`, sorted by the one who asks, then by
  /// who is found. `room(n)` makes room for n of them and says where they go. Returns n.
  template <class Index, class Pairing, class Room>
  std::int64_t ask(kernels::Askers<S> const& by, Index const& index, Pairing const& pairing,
                   Room const& room) const {
    using Find = kernels::FindPairs<S, Index, Pairing>;
    Kokkos::View<std::int64_t*, typename S::memory> const begin(begin_,
                                                                Kokkos::make_pair(0, by.count));
    Find const find{index, pairing, by, begin, partner_};
    for_each<S>("candidates_find", (by.count + Find::group - 1) / Find::group, find);
    std::int64_t const total = exclusive_scan<S, std::int64_t>("candidates_begin", begin);
    auto const writer = room(total);
    using Writer = std::remove_const_t<decltype(writer)>;
    for_each<S>("candidates_fill", by.count,
                kernels::FillPairs<S, Index, Pairing, Writer>{find, total, writer});
    return total;
  }

private:
  Kokkos::View<std::int64_t*, typename S::memory> begin_;
  Kokkos::View<int*, typename S::memory> partner_;
};

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
      : boxes_(surface, edge_length),
        triangles_(params, surface.triangles(), edge_length),
        edges_(params, surface.edges(), edge_length),
        inquiry_(std::max(surface.vertices(), surface.edges())) {}

  /// All pairs that come closer than `radius` (m) during the motion, and some that do not. Throws
  /// Error for places that are not finite, and for more pairs than an int can count.
  template <class Precision>
  void find(Motion<Precision, Space> const& motion, double radius, Candidates<Space>& found) {
    boxes_.compute(motion, radius);
    triangles_.build(boxes_.triangles());
    edges_.build(boxes_.edges());
    SurfaceViews<Space> const& surface = boxes_.surface();
    kernels::Held<Space> const held{motion.fixed, motion.between_fixed};
    ask(boxes_.points(), triangles_.index(), kernels::PairPointTriangle<Space>{{surface, held}},
        found.point_triangle);
    ask(boxes_.edges(), edges_.index(),
        kernels::PairEdgeEdge<Space>{{surface, held}, boxes_.edges().rank}, found.edge_edge);
  }

  SurfaceViews<Space> const& surface() const { return boxes_.surface(); }

private:
  template <class Index, class Pairing>
  void ask(BoxSet<Space> const& by, Index const& index, Pairing const& pairing,
           CandidateList<Pairing::kind, Space>& found) const {
    inquiry_.ask({by.box, by.count}, index, pairing, [&](std::int64_t n) {
      found.resize(n);
      return kernels::WriteVertices<Space>{boxes_.surface(), found.ids()};
    });
  }

  SurfaceBoxes<Space> boxes_;
  Policy triangles_, edges_;
  BoxInquiry<Space> inquiry_;
};

}  // namespace taut
