// A hierarchy of boxes, eight to a node: the boxes in the order of a space-filling curve through
// their centres (Morton order; Lauterbach et al., "Fast BVH construction on GPUs", 2009), eight
// that follow each other in a bundle; the boxes around bundles, eight in a bundle of the next
// level; and so on to a single one (Wald et al., "Getting rid of packets", 2008, on trees of such
// width). No pointer is stored: bundle j of a level is around bundles 8 j to 8 j + 7 of the one
// below. A query is compared with the eight boxes of a bundle at once, in one register per bound on
// the host, so it takes few branches that nobody can foresee.
//
// Boxes that have moved a little keep their order, and their hierarchy is only computed anew
// (refitted); it is put in order again when the sum of its boxes' sides has grown by a given factor
// over what it was after the last sort. What is found depends on neither.
#pragma once

#include <taut/contact/broad_phase.hpp>
#include <taut/core/exec/sort.hpp>
#include <taut/core/math/bits.hpp>

#include <bit>

namespace taut {

namespace kernels {

/// Three numbers below 1024, their bits in turns.
KOKKOS_INLINE_FUNCTION std::uint32_t morton_code(std::uint32_t const (&x)[3]) {
  std::uint32_t code = 0;
  for (int c = 0; c < 3; ++c) {
    std::uint32_t b = x[c];
    b = (b | b << 16) & 0x030000ffu;
    b = (b | b << 8) & 0x0300f00fu;
    b = (b | b << 4) & 0x030c30c3u;
    b = (b | b << 2) & 0x09249249u;
    code |= b << c;
  }
  return code;
}

template <class S>
struct CurvePlaces {
  Kokkos::View<SearchBox const*, typename S::memory> box;
  SearchBox all;
  Kokkos::View<std::uint32_t*, typename S::memory> place;
  KOKKOS_FUNCTION void operator()(int i) const {
    std::uint32_t cell[3];
    float const side = longest_side(all);
    for (int c = 0; c < 3; ++c) {
      // Halves, which do not overflow. Not a number if a bound is infinite: then cell 0 will do.
      float const centre = 0.5f * box(i).low[c] + 0.5f * box(i).high[c];
      float const place_in_all = 1024 * (centre - all.low[c]) / side;
      cell[c] =
          place_in_all > 0 ? static_cast<std::uint32_t>(Kokkos::min(place_in_all, 1023.f)) : 0u;
    }
    place(i) = morton_code(cell);
  }
};

/// Eight boxes, bound by bound, with the highest rank of what is in each.
struct BoxBundle {
  static constexpr int size = 8;
  float low[3][size], high[3][size];
  Rank rank[size];
  int held[size];

  /// Bit b is set if box b overlaps `query` and holds something of the rank `least` or above.
  KOKKOS_FORCEINLINE_FUNCTION unsigned overlapping(SearchBox const& query, Rank least) const {
    int const held_alike = query.held > 0 ? query.held : -2;  // which none is
    return bits_where<size>([&](int b) {
      bool here = (rank[b] >= least) & (held[b] != held_alike);
      for (int c = 0; c < 3; ++c) {
        here &= (low[c][b] <= query.high[c]) & (query.low[c] <= high[c][b]);
      }
      return here;
    });
  }
  KOKKOS_FUNCTION void set(int b, SearchBox const& box, Rank highest_in_it) {
    for (int c = 0; c < 3; ++c) {
      low[c][b] = box.low[c];
      high[c][b] = box.high[c];
    }
    rank[b] = highest_in_it;
    held[b] = box.held;
  }
  KOKKOS_FUNCTION SearchBox box(int b) const {
    return {{low[0][b], low[1][b], low[2][b]}, {high[0][b], high[1][b], high[2][b]}, held[b]};
  }
  /// Around all of them.
  KOKKOS_FUNCTION SearchBox all() const {
    SearchBox result = empty_box();
    for (int b = 0; b < size; ++b) result = join(result, box(b));
    return result;
  }
  KOKKOS_FUNCTION Rank highest_rank() const {
    Rank result = no_rank;
    for (int b = 0; b < size; ++b) result = Kokkos::max(result, rank[b]);
    return result;
  }
};

/// Bundle g of boxes; what is left of the last one is empty.
template <class S>
struct BundleBoxes {
  BoxSet<S> boxes;
  Kokkos::View<int const*, typename S::memory> order;
  Kokkos::View<BoxBundle*, typename S::memory> bundle;
  KOKKOS_FUNCTION void operator()(int g) const {
    for (int b = 0; b < BoxBundle::size; ++b) {
      int const k = BoxBundle::size * g + b;
      if (k < boxes.count) {
        bundle(g).set(b, boxes.box(order(k)), boxes.rank(order(k)));
      } else {
        bundle(g).set(b, empty_box(), no_rank);
      }
    }
  }
};

/// Bundle g of a level, from the `count` bundles of the one below.
template <class S>
struct BundleBundles {
  Kokkos::View<BoxBundle*, typename S::memory> bundle;
  int first, first_below, count;
  KOKKOS_FUNCTION void operator()(int g) const {
    for (int b = 0; b < BoxBundle::size; ++b) {
      int const k = BoxBundle::size * g + b;
      if (k < count) {
        BoxBundle const& below = bundle(first_below + k);
        bundle(first + g).set(b, below.all(), below.highest_rank());
      } else {
        bundle(first + g).set(b, empty_box(), no_rank);
      }
    }
  }
};

/// Sides of the box around bundle g.
template <class S>
struct BundleSides {
  Kokkos::View<BoxBundle const*, typename S::memory> bundle;
  KOKKOS_FUNCTION void operator()(int g, Sums<double, 1>& sum) const {
    SearchBox const b = bundle(g).all();
    for (int c = 0; c < 3; ++c) sum[0] += double(b.high[c]) - double(b.low[c]);
  }
};

/// Where the levels begin among all bundles, that of the boxes first.
struct BundleLevels {
  static constexpr int most = 11;  ///< 8^11 boxes are more than an int can count
  int begin[most + 1] = {};
  int count = 0;

  explicit BundleLevels(int boxes = 0) {
    for (int n = boxes; count == 0 || n > 1; ++count) {
      n = n / BoxBundle::size + (n % BoxBundle::size > 0);
      begin[count + 1] = begin[count] + std::max(n, 1);
    }
  }
  KOKKOS_FUNCTION int bundles(int level) const { return begin[level + 1] - begin[level]; }
};

}  // namespace kernels

template <class S = DefaultSpace>
class Bvh {
public:
  using Space = S;
  struct Params {
    double growth = 1.3;  ///< of the sides of all nodes, at which the boxes are sorted anew
  };
  struct Index {
    kernels::BundleLevels levels;
    Kokkos::View<kernels::BoxBundle const*, typename S::memory> bundle;
    Kokkos::View<int const*, typename S::memory> order;

    template <class Visitor>
    KOKKOS_FUNCTION void visit(SearchBox const& query, Rank least, Visitor&& visitor) const {
      visit_bundles(query, least, One<std::remove_reference_t<Visitor>>{*this, visitor});
    }
    /// Goes down with the box around as many of the group as lie together; what this meets is
    /// compared with all of them.
    template <class Visitor>
    KOKKOS_FUNCTION void visit_group(QueryGroup const& group, Visitor&& visitor) const {
      for (int first = 0, end = 0; first < group.count; first = end) {
        SearchBox around = group.box[first];
        Rank least = group.least[first];
        float side = longest_side(around);
        for (end = first + 1; end < group.count; ++end) {
          SearchBox const more = join(around, group.box[end]);
          float const larger = Kokkos::max(side, longest_side(group.box[end]));
          if (longest_side(more) > together * larger) break;
          around = more;
          side = larger;
          least = Kokkos::min(least, group.least[end]);
        }
        kernels::BoxBundle queries;
        for (int a = 0; a < width; ++a) {
          queries.set(a, first <= a && a < end ? group.box[a] : empty_box(), lowest_rank);
        }
        visit_bundles(around, least,
                      Group<std::remove_reference_t<Visitor>>{*this, queries, visitor});
      }
    }

  private:
    static constexpr int width = kernels::BoxBundle::size;
    /// Boxes lie together if the one around them is no more than this times as long as one of them.
    static constexpr float together = 4;
    KOKKOS_FUNCTION int partner(int g, int b) const { return order(width * g + b); }

    template <class Visitor>
    struct One {
      Index const& index;
      Visitor& visitor;
      KOKKOS_FORCEINLINE_FUNCTION void operator()(int g, unsigned bits) const {
        for (; bits != 0; bits &= bits - 1) visitor(index.partner(g, lowest_bit(bits)));
      }
    };
    template <class Visitor>
    struct Group {
      Index const& index;
      kernels::BoxBundle const& queries;
      Visitor& visitor;
      KOKKOS_FORCEINLINE_FUNCTION void operator()(int g, unsigned bits) const {
        for (; bits != 0; bits &= bits - 1) {
          int const b = lowest_bit(bits), j = index.partner(g, b);
          unsigned const asking = queries.overlapping(index.bundle(g).box(b), lowest_rank);
          if (asking != 0) visitor(asking, j);
        }
      }
    };

    /// Calls found(g, bits) for bundles g of boxes of which some overlap. Depth first, with what is
    /// still to be visited of one bundle per level.
    template <class Found>
    KOKKOS_FUNCTION void visit_bundles(SearchBox const& query, Rank least,
                                       Found const& found) const {
      int node[kernels::BundleLevels::most];
      unsigned rest[kernels::BundleLevels::most];
      int const top = levels.count - 1;
      int level = top;
      node[level] = 0;
      rest[level] = bundle(levels.begin[level]).overlapping(query, least);
      for (;;) {
        if (level == 0) {
          if (rest[0] != 0) found(node[0], rest[0]);
          rest[0] = 0;
        }
        while (rest[level] == 0) {
          if (level == top) return;
          ++level;
        }
        int const next = width * node[level] + lowest_bit(rest[level]);
        rest[level] &= rest[level] - 1;
        --level;
        node[level] = next;
        rest[level] = bundle(levels.begin[level] + next).overlapping(query, least);
      }
    }
  };

  Bvh() = default;
  Bvh(Params const& params, int count, double)
      : params_(params),
        levels_(count),
        bundle_("bvh_bundle", levels_.begin[levels_.count]),
        place_("bvh_place", count),
        order_("bvh_order", count),
        sort_(count),
        reducer_(levels_.begin[levels_.count], 1) {}

  void build(BoxSet<S> const& boxes) {
    if (sorts_ > 0) {
      fit(boxes);
      if (sides() <= params_.growth * sorted_sides_) return;
    }
    for_each<S>("bvh_places", boxes.count, kernels::CurvePlaces<S>{boxes.box, boxes.all, place_});
    sort_.sort(boxes.count, place_, order_);
    fit(boxes);
    sorted_sides_ = sides();
    ++sorts_;
  }
  Index index() const { return {levels_, bundle_, order_}; }
  int sorts() const { return sorts_; }

private:
  void fit(BoxSet<S> const& boxes) const {
    for_each<S>("bvh_boxes", levels_.bundles(0), kernels::BundleBoxes<S>{boxes, order_, bundle_});
    for (int l = 1; l < levels_.count; ++l) {
      for_each<S>("bvh_level", levels_.bundles(l),
                  kernels::BundleBundles<S>{bundle_, levels_.begin[l], levels_.begin[l - 1],
                                            levels_.bundles(l - 1)});
    }
  }
  double sides() const {
    if (place_.extent(0) == 0) return 0;
    return reducer_.template sum<1>("bvh_sides", levels_.begin[levels_.count],
                                    kernels::BundleSides<S>{bundle_})[0];
  }

  Params params_;
  kernels::BundleLevels levels_;
  int sorts_ = 0;
  Kokkos::View<kernels::BoxBundle*, typename S::memory> bundle_;
  Kokkos::View<std::uint32_t*, typename S::memory> place_;
  Kokkos::View<int*, typename S::memory> order_;
  StableSort<S, std::uint32_t> sort_;
  Reducer<S> reducer_;
  double sorted_sides_ = 0;
};

}  // namespace taut
