// The nodes of one level of a sparse grid as kernels see them. A grid is made of leaves, cubes of
// 8^3 nodes of which some are active; nodes are numbered leaf by leaf, in a leaf with z fastest, so
// that the rank of a node is a count of bits:
//
//   node(i, j, k) = first(leaf, i & 7) + number of bits of mask(leaf, i & 7) below 8 (j & 7) + (k &
//   7)
//
// which takes 96 bytes per leaf where a table of its 512 nodes would take 2 kB. Leaves are found
// through a hash of their places, those around a leaf through a table of its 27 neighbours.
#pragma once

#include <taut/core/exec/space.hpp>
#include <taut/core/math/bits.hpp>

#include <cstdint>

namespace taut {

/// Leaves by place.
template <class S>
struct LeafTable {
  Kokkos::View<int* [3], Kokkos::LayoutRight, typename S::memory> origin;  ///< multiples of 8
  Kokkos::View<int*, typename S::memory> bucket;                           ///< a leaf, or -1
  unsigned wrap = 0;  ///< buckets in use - 1: a power of two less one
  int count = 0;

  KOKKOS_FUNCTION static unsigned hash(int i, int j, int k) { return mix(i >> 3, j >> 3, k >> 3); }
  KOKKOS_FUNCTION static unsigned mix(int i, int j, int k) {
    unsigned h = static_cast<unsigned>(i) * 0x9e3779b1u ^ static_cast<unsigned>(j) * 0x85ebca77u ^
                 static_cast<unsigned>(k) * 0xc2b2ae3du;
    h ^= h >> 15;
    h *= 0x27d4eb2fu;
    return h ^ h >> 13;
  }
  /// The leaf that holds the place (i, j, k), or -1.
  KOKKOS_FUNCTION int find(int i, int j, int k) const {
    if (count == 0) return -1;
    for (unsigned b = hash(i, j, k) & wrap;; b = (b + 1) & wrap) {
      int const leaf = bucket(b);
      if (leaf < 0 || (origin(leaf, 0) == (i & ~7) && origin(leaf, 1) == (j & ~7) &&
                       origin(leaf, 2) == (k & ~7))) {
        return leaf;
      }
    }
  }
};

/// Active nodes of one level, numbered leaf by leaf. Arrays may be longer than what is in use.
template <class S = DefaultSpace>
struct GridNodes {
  template <class T>
  using PerLeaf = Kokkos::View<T, Kokkos::LayoutRight, typename S::memory>;

  int count = 0;  ///< active nodes
  double dx = 1;  ///< spacing, m: the place of a node is its ijk times dx
  Kokkos::View<int* [3], typename S::layout, typename S::memory> ijk;
  Kokkos::View<int*, typename S::memory> leaf;  ///< of a node

  LeafTable<S> leaves;
  PerLeaf<int*> begin;               ///< the first node of a leaf; one entry more than leaves
  PerLeaf<std::uint64_t* [8]> mask;  ///< bit 8 y + z of word x
  PerLeaf<int* [8]> first;           ///< the first node of each word
  PerLeaf<int* [27]> neighbours;     ///< 9 (x + 1) + 3 (y + 1) + (z + 1); -1 where there is none

  /// The number of node (i, j, k), or -1 if it is not active.
  KOKKOS_FUNCTION int node(int i, int j, int k) const {
    int const l = leaves.find(i, j, k);
    return l < 0 ? -1 : in_leaf(l, i, j, k);
  }
  /// The same, of a place in leaf l.
  KOKKOS_FUNCTION int in_leaf(int l, int i, int j, int k) const {
    std::uint64_t const word = mask(l, i & 7), bit = std::uint64_t(1) << (8 * (j & 7) + (k & 7));
    return (word & bit) == 0 ? -1 : first(l, i & 7) + count_bits(word & (bit - 1));
  }
  /// The leaf, l or one of its 26 neighbours, that holds a place at most 8 nodes outside l; or -1.
  KOKKOS_FUNCTION int leaf_near(int l, int i, int j, int k) const {
    int const x = (i >> 3) - (leaves.origin(l, 0) >> 3), y = (j >> 3) - (leaves.origin(l, 1) >> 3),
              z = (k >> 3) - (leaves.origin(l, 2) >> 3);
    return neighbours(l, 9 * (x + 1) + 3 * (y + 1) + (z + 1));
  }
  /// The number of a node at most 8 nodes outside leaf l, or -1 if it is not active.
  KOKKOS_FUNCTION int near(int l, int i, int j, int k) const {
    int const found = leaf_near(l, i, j, k);
    return found < 0 ? -1 : in_leaf(found, i, j, k);
  }
  /// The number of the node at (i, j, k) from node n, each at most 8, or -1 if it is not active.
  KOKKOS_FUNCTION int beside(int n, int i, int j, int k) const {
    return near(leaf(n), ijk(n, 0) + i, ijk(n, 1) + j, ijk(n, 2) + k);
  }
};

}  // namespace taut
