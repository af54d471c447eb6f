// A hashed grid, after the dense hash of the PNCG paper's code (counts, prefix sums and one array
// of items; Mueller 2021, "Blazing fast neighbor search with spatial hashing"), made to miss
// nothing.
//
// The grid has levels. Level l has cells of the size s = s0 2^l, and holds the boxes whose longest
// side is in [s / 2, s), level 0 also all smaller ones and the last all larger ones, so a box and
// the cell in which its low corner lies are about of a size, whatever edges the surface has. Each
// box is in that one cell alone. It reaches into the next cell along each axis at most, so the
// boxes of a level that overlap a given one are in the cells from one below its low corner's to its
// high corner's. All levels share a table of buckets,
//
//   bucket = (i_x + h(i_y, i_z, l)) mod 2^b,   2^b about twice the number of boxes,
//
// whose neighbours along x are neighbours in memory. What another cell has put into a bucket is
// told by its own cell, so nothing is seen twice.
//
// Cells are found as floor(low / s) with s a power of two: exact in floating point. Beyond 2^30
// cells from the centre they are one; this, too, keeps the order of the corners, so that what
// overlaps meets. No coordinate, however large, and no edge, however long, is an exception.
#pragma once

#include <taut/contact/broad_phase.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/sort.hpp>
#include <taut/core/math/bits.hpp>

#include <bit>

namespace taut {

namespace kernels {

/// The class of a box or a length by size: c where the longest side is in [2^c, 2^(c + 1)).
using SizeClass = int;

KOKKOS_FORCEINLINE_FUNCTION SizeClass size_class(float longest) {
  return static_cast<int>(Kokkos::bit_cast<std::uint32_t>(longest) >> 23 & 255u) - 127;
}

/// The grid: cells of level l have the size 2^(first + 1 + l).
struct HashGrid {
  static constexpr int levels = 32;
  SizeClass first = 0;
  unsigned mask = 0;  ///< number of buckets - 1

  KOKKOS_FUNCTION int level(SizeClass c) const {
    return Kokkos::min(Kokkos::max(c - first, 0), levels - 1);
  }
  KOKKOS_FUNCTION int level(SearchBox const& box) const {
    return level(size_class(longest_side(box)));
  }

  KOKKOS_FUNCTION int cell(float x, int level) const {
    int const exponent = first + 1 + level;
    // The last level holds boxes of any size, and these are beyond what a float can be divided by.
    if (level == levels - 1 || exponent > 126) return 0;
    constexpr float farthest = 1 << 30;
    float const inverse_size = Kokkos::bit_cast<float>(
        static_cast<std::uint32_t>(127 - Kokkos::max(exponent, -127)) << 23);
    float const i = Kokkos::floor(x * inverse_size);
    return static_cast<int>(Kokkos::min(Kokkos::max(i, -farthest), farthest));
  }
  /// Of the row of cells along x.
  KOKKOS_FUNCTION unsigned row(int y, int z, int level) const {
    unsigned h = static_cast<unsigned>(y) * 0x9e3779b1u ^ static_cast<unsigned>(z) * 0x85ebca77u ^
                 static_cast<unsigned>(level) * 0xc2b2ae3du;
    h ^= h >> 15;
    return h * 0x27d4eb2fu;
  }
  KOKKOS_FUNCTION unsigned bucket(unsigned row, int x) const {
    return (row + static_cast<unsigned>(x)) & mask;
  }
};

template <class S>
struct HashBoxes {
  HashGrid grid;
  Kokkos::View<SearchBox const*, typename S::memory> box;
  Kokkos::View<int*, typename S::memory> bucket;
  Kokkos::View<unsigned, typename S::memory> occupied;  ///< one bit per level
  KOKKOS_FUNCTION void operator()(int i) const {
    SearchBox const b = box(i);
    int const l = grid.level(b);
    bucket(i) = static_cast<int>(grid.bucket(
        grid.row(grid.cell(b.low[1], l), grid.cell(b.low[2], l), l), grid.cell(b.low[0], l)));
    unsigned const bit = 1u << l;
    if ((occupied() & bit) == 0) Kokkos::atomic_or(&occupied(), bit);
  }
};

/// Boxes in the order of the buckets: what a search reads lies together.
template <class S>
struct SortBoxes {
  Kokkos::View<SearchBox const*, typename S::memory> from;
  Kokkos::View<int const*, typename S::memory> order;
  Kokkos::View<SearchBox*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int k) const { to(k) = from(order(k)); }
};

}  // namespace kernels

template <class S = DefaultSpace>
class SpatialHash {
public:
  using Space = S;
  struct Params {
    double cell =
        1;  ///< size of the smallest cells in mean edges, rounded up to a power of two of m
  };
  struct Index {
    kernels::HashGrid grid;
    Kokkos::View<unsigned const, typename S::memory> occupied;
    Kokkos::View<int const*, typename S::memory> begin, order;
    Kokkos::View<SearchBox const*, typename S::memory> box;  ///< in that order
    int count;

    template <class Visitor>
    KOKKOS_FUNCTION void visit(SearchBox const& query, Rank, Visitor&& visitor) const {
      unsigned const levels = occupied();
      double cells = 0;
      for (unsigned rest = levels; rest != 0; rest &= rest - 1) {
        Range const r = range(query, lowest_bit(rest));
        cells += double(r.high[0] - r.low[0] + 1) * double(r.high[1] - r.low[1] + 1) *
                 double(r.high[2] - r.low[2] + 1);
      }
      if (cells > double(count)) {  // a box that is large for this grid: through all
        for (int k = 0; k < count; ++k) {
          if (overlap(query, box(k))) visitor(order(k));
        }
        return;
      }
      for (unsigned rest = levels; rest != 0; rest &= rest - 1) {
        visit_level(query, lowest_bit(rest), visitor);
      }
    }

  private:
    struct Range {
      std::int64_t low[3], high[3];
    };
    KOKKOS_FUNCTION Range range(SearchBox const& query, int level) const {
      Range r;
      for (int c = 0; c < 3; ++c) {
        r.low[c] = std::int64_t(grid.cell(query.low[c], level)) - 1;
        r.high[c] = grid.cell(query.high[c], level);
      }
      return r;
    }
    /// Row by row: cells along x are neighbours in memory, so a row is one run of boxes, or two
    /// where its buckets go over the end of the table. It is shorter than the table, as there are
    /// no more cells than boxes.
    template <class Visitor>
    KOKKOS_FUNCTION void visit_level(SearchBox const& query, int level, Visitor&& visitor) const {
      Range const r = range(query, level);
      unsigned const cells = static_cast<unsigned>(r.high[0] - r.low[0] + 1);
      for (std::int64_t z = r.low[2]; z <= r.high[2]; ++z)
        for (std::int64_t y = r.low[1]; y <= r.high[1]; ++y) {
          Row const row{level, static_cast<int>(y), static_cast<int>(z)};
          unsigned const first =
              grid.bucket(grid.row(row.y, row.z, level), static_cast<int>(r.low[0]));
          unsigned const last = first + cells - 1;
          visit_run(query, row, begin(first), begin(Kokkos::min(last, grid.mask) + 1), visitor);
          if (last > grid.mask) visit_run(query, row, 0, begin((last & grid.mask) + 1), visitor);
        }
    }
    struct Row {
      int level, y, z;
    };
    /// Boxes that overlap are in cells of the row by what the grid promises of x.
    template <class Visitor>
    KOKKOS_FUNCTION void visit_run(SearchBox const& query, Row const& row, int first, int end,
                                   Visitor&& visitor) const {
      for (int k = first; k < end; ++k) {
        SearchBox const b = box(k);
        if (overlap(query, b) && grid.cell(b.low[1], row.level) == row.y &&
            grid.cell(b.low[2], row.level) == row.z && grid.level(b) == row.level) {
          visitor(order(k));
        }
      }
    }
  };

  SpatialHash() = default;
  /// Throws Error unless `length` and `params.cell` are positive and finite.
  SpatialHash(Params const& params, int count, double length)
      : sort_(count),
        bucket_("hash_bucket", count),
        order_("hash_order", count),
        box_("hash_box", count),
        occupied_("hash_occupied") {
    float const size = static_cast<float>(params.cell * length);
    if (count > 0 && !(size > 0 && size <= std::numeric_limits<float>::max())) {
      throw Error(
          "spatial hash: {} cells per edge and edges of {} m give no cell size: check the surface",
          params.cell, length);
    }
    grid_.first = kernels::size_class(size);
    grid_.mask = std::bit_ceil(2 * static_cast<unsigned>(std::max(count, 1))) - 1;
    begin_ = Kokkos::View<int*, typename S::memory>("hash_begin", std::size_t(grid_.mask) + 2);
  }

  void build(BoxSet<S> const& boxes) {
    assign_on<S>(occupied_, 0u);
    for_each<S>("hash_boxes", boxes.count,
                kernels::HashBoxes<S>{grid_, boxes.box, bucket_, occupied_});
    sort_.sort(boxes.count, bucket_, static_cast<int>(grid_.mask + 1), begin_, order_);
    for_each<S>("hash_sort", boxes.count, kernels::SortBoxes<S>{boxes.box, order_, box_});
  }
  Index index() const {
    return {grid_, occupied_, begin_, order_, box_, static_cast<int>(box_.extent(0))};
  }

private:
  kernels::HashGrid grid_;
  BucketSort<S> sort_;
  Kokkos::View<int*, typename S::memory> begin_, bucket_, order_;
  Kokkos::View<SearchBox*, typename S::memory> box_;
  Kokkos::View<unsigned, typename S::memory> occupied_;
};

}  // namespace taut
