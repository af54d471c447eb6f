// A hierarchy of boxes: the boxes in the order of a space-filling curve through their centres
// (Morton order; Lauterbach et al., "Fast BVH construction on GPUs", 2009) are the leaves of the
// complete binary tree over them, and each node is the box around its two children. The tree's
// shape is that of a heap: node k has the children 2 k and 2 k + 1, the leaves are the last level,
// and no pointer is stored.
//
// Boxes that have moved a little keep their order, and their hierarchy is only computed anew
// (refitted); it is put in order again when the sum of its boxes' sides has grown by a given factor
// over what it was after the last sort. What is found depends on neither.
//
// A search needs no stack: after a node, or after the subtree of it that was passed over, comes the
// right sibling of the lowest of its ancestors (or itself) that is a left child. In k + 1 the
// trailing zero bits are the levels to go up.
#pragma once

#include <taut/contact/broad_phase.hpp>
#include <taut/core/exec/sort.hpp>

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

/// The box and the largest size class of what is below a node.
template <class S>
struct BvhNodes {
  Kokkos::View<SearchBox*, typename S::memory> box;
  Kokkos::View<SizeClass*, typename S::memory> largest;
};

inline constexpr SizeClass no_class = smallest_class - 1;

/// Leaf k, or an empty one beyond the last box.
template <class S>
struct BvhLeaves {
  Kokkos::View<SearchBox const*, typename S::memory> from;
  Kokkos::View<int const*, typename S::memory> order;
  BvhNodes<S> node;
  int count, leaves;
  KOKKOS_FUNCTION void operator()(int k) const {
    SearchBox const box = k < count ? from(order(k)) : empty_box();
    node.box(leaves + k) = box;
    node.largest(leaves + k) = k < count ? size_class(longest_side(box)) : no_class;
  }
};

/// Node first + k, from its children.
template <class S>
struct BvhLevel {
  BvhNodes<S> node;
  int first;
  KOKKOS_FUNCTION void operator()(int k) const {
    int const n = first + k;
    node.box(n) = join(node.box(2 * n), node.box(2 * n + 1));
    node.largest(n) = Kokkos::max(node.largest(2 * n), node.largest(2 * n + 1));
  }
};

/// Sides of the node k + 1, if it is not empty.
template <class S>
struct BvhSides {
  BvhNodes<S> node;
  KOKKOS_FUNCTION void operator()(int k, Sums<double, 1>& sum) const {
    if (node.largest(k + 1) == no_class) return;
    SearchBox const b = node.box(k + 1);
    for (int c = 0; c < 3; ++c) sum[0] += double(b.high[c]) - double(b.low[c]);
  }
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
    kernels::BvhNodes<S> node;
    Kokkos::View<int const*, typename S::memory> order;
    int leaves;

    template <class Visitor>
    KOKKOS_FUNCTION void visit(SearchBox const& query, SizeClass least, Visitor&& visitor) const {
      unsigned k = 1;
      do {
        if (node.largest(k) >= least && overlap(query, node.box(k))) {
          if (k < static_cast<unsigned>(leaves)) {
            k = 2 * k;
            continue;
          }
          visitor(order(k - static_cast<unsigned>(leaves)));
        }
        ++k;
        k >>= Kokkos::countr_zero(k);
      } while (k != 1);
    }
  };

  Bvh() = default;
  Bvh(Params const& params, int count, double)
      : params_(params),
        leaves_(static_cast<int>(std::bit_ceil(static_cast<unsigned>(std::max(count, 1))))),
        node_{Kokkos::View<SearchBox*, typename S::memory>("bvh_box", 2 * std::size_t(leaves_)),
              Kokkos::View<SizeClass*, typename S::memory>("bvh_class", 2 * std::size_t(leaves_))},
        place_("bvh_place", count),
        order_("bvh_order", count),
        sort_(count),
        reducer_(2 * leaves_, 1) {}

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
  Index index() const { return {node_, order_, leaves_}; }
  int sorts() const { return sorts_; }

private:
  void fit(BoxSet<S> const& boxes) const {
    for_each<S>("bvh_leaves", leaves_,
                kernels::BvhLeaves<S>{boxes.box, order_, node_, boxes.count, leaves_});
    for (int first = leaves_ / 2; first > 0; first /= 2) {
      for_each<S>("bvh_level", first, kernels::BvhLevel<S>{node_, first});
    }
  }
  double sides() const {
    return reducer_.template sum<1>("bvh_sides", 2 * leaves_ - 1, kernels::BvhSides<S>{node_})[0];
  }

  Params params_;
  int leaves_ = 1, sorts_ = 0;
  kernels::BvhNodes<S> node_;
  Kokkos::View<std::uint32_t*, typename S::memory> place_;
  Kokkos::View<int*, typename S::memory> order_;
  StableSort<S, std::uint32_t> sort_;
  Reducer<S> reducer_;
  double sorted_sides_ = 0;
};

}  // namespace taut
