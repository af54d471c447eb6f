// The work of loops over the nodes of a grid: blocks of 4^3 nodes, eight to a leaf. A block is one
// of eight colours, its octant in the leaf; the nodes of two blocks of a colour are at least five
// apart, so no stencil of radius 2 or 3 couples them. A block reads its surroundings once, into a
// dense window in which what is not active is zero: then every stencil in it is a plain loop.
#pragma once

#include <taut/core/math/bits.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/mpm/grid_nodes.hpp>

namespace taut::kernels {

template <class T, class Field>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> vector_of(Field const& field, int i) {
  return {T(field(i, 0)), T(field(i, 1)), T(field(i, 2))};
}
template <class T, class Field>
KOKKOS_FORCEINLINE_FUNCTION void set_vector(Field const& field, int i, Vec3<T> const& value) {
  using Stored = typename Field::non_const_value_type;
  for (int c = 0; c < 3; ++c) field(i, c) = static_cast<Stored>(value[c]);
}

/// The active nodes of block `octant` = 4 (x > 3) + 2 (y > 3) + (z > 3) of a leaf, in their order.
template <class S>
struct NodeBlock {
  int leaf, octant, count = 0;
  int low[3];  ///< lowest place of the block
  int node[64];
  unsigned char place[64];  ///< 16 x + 4 y + z in the block

  KOKKOS_FUNCTION NodeBlock(GridNodes<S> const& nodes, int leaf_, int octant_)
      : leaf(leaf_), octant(octant_) {
    for (int c = 0; c < 3; ++c) low[c] = nodes.leaves.origin(leaf, c) + 4 * (octant >> (2 - c) & 1);
    for (int x = 0; x < 4; ++x) {
      std::uint64_t const word = nodes.mask(leaf, (low[0] & 7) + x);
      int const first = nodes.first(leaf, (low[0] & 7) + x);
      for (int y = 0; y < 4; ++y) {
        int const shift = 8 * ((low[1] & 7) + y) + (low[2] & 7);
        unsigned bits = static_cast<unsigned>(word >> shift) & 0xf;
        if (bits == 0) continue;
        int next = first + count_bits(word & ((std::uint64_t(1) << shift) - 1));
        for (; bits != 0; bits &= bits - 1, ++count, ++next) {
          node[count] = next;
          place[count] = static_cast<unsigned char>(16 * x + 4 * y + lowest_bit(bits));
        }
      }
    }
  }
};

/// Which nodes around one count: all, or those of the blocks whose colour comes before or after,
/// and within the block those that the sweep has been at.
enum class Part { all, before, after };

/// Vectors of a block and of `radius` nodes around it.
template <class T, int radius>
struct Window {
  static_assert(radius <= 4);
  static constexpr int width = 4 + 2 * radius;
  static constexpr int slack = 4;  ///< a stencil's runs are padded, and may be read beyond the last
  T value[3 * width * width * width + slack];

  /// Of the place (x, y, z), counted from the lowest of the block.
  KOKKOS_FORCEINLINE_FUNCTION T* at(int x, int y, int z) {
    return value + 3 * (((x + radius) * width + y + radius) * width + z + radius);
  }

  /// Takes in the vectors of `part`; the others are zero.
  template <class S, class Field>
  KOKKOS_FUNCTION void load(GridNodes<S> const& nodes, NodeBlock<S> const& block,
                            Field const& field, Part part) {
    for (T& v : value) v = 0;
    for (int b = 0; b < 27; ++b) {
      int const side[3] = {b / 9 - 1, b / 3 % 3 - 1, b % 3 - 1};
      int const colour =
          block.octant ^ (side[0] != 0 ? 4 : 0) ^ (side[1] != 0 ? 2 : 0) ^ (side[2] != 0 ? 1 : 0);
      if (part == Part::before && colour >= block.octant) continue;
      if (part == Part::after && colour <= block.octant) continue;
      load(nodes, block, field, side);
    }
  }

private:
  /// What the window sees of one of the 27 blocks.
  template <class S, class Field>
  KOKKOS_FUNCTION void load(GridNodes<S> const& nodes, NodeBlock<S> const& block,
                            Field const& field, int const (&side)[3]) {
    int from[3], length[3];
    for (int c = 0; c < 3; ++c) {
      from[c] = side[c] < 0 ? -radius : 4 * side[c];
      length[c] = side[c] == 0 ? 4 : radius;
    }
    int const i = block.low[0] + from[0], j = block.low[1] + from[1], k = block.low[2] + from[2];
    int const leaf = nodes.leaf_near(block.leaf, i, j, k);
    if (leaf < 0) return;
    for (int x = 0; x < length[0]; ++x) {
      std::uint64_t const word = nodes.mask(leaf, (i & 7) + x);
      if (word == 0) continue;
      int const first = nodes.first(leaf, (i & 7) + x);
      for (int y = 0; y < length[1]; ++y) {
        int const shift = 8 * ((j & 7) + y) + (k & 7);
        unsigned bits = static_cast<unsigned>(word >> shift) & ((1u << length[2]) - 1);
        if (bits == 0) continue;
        int next = first + count_bits(word & ((std::uint64_t(1) << shift) - 1));
        for (T* to = at(from[0] + x, from[1] + y, from[2]); bits != 0; bits >>= 1, to += 3) {
          if ((bits & 1) == 0) continue;
          for (int c = 0; c < 3; ++c) to[c] = T(field(next, c));
          ++next;
        }
      }
    }
  }
};

}  // namespace taut::kernels
