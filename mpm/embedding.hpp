// How a fine level hangs on the next coarser one (Wang et al. 2020, section 4): coarse node c lies
// on fine node 2c, and a fine node moves with the coarse nodes around it, with weights w(f - 2c)
// along each axis. Restriction is the transpose of that, and coarse matrices are P'AP: the coarse
// unknowns are those of the fine level, held together, so nothing is asked of what the level stands
// for.
//
// The weights of a node add up to one; coarse nodes are those with a weight at all. With linear
// weights P has full rank over the nodes that kernels reach; where fixed nodes leave single free
// ones between coarse nodes it has not, and A_c is singular, which smoothers and the inverse of the
// coarsest level must bear.
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/mpm/node_block.hpp>

namespace taut {

/// 1 on the node, 1/2 beside it.
struct LinearEmbedding {
  static constexpr char const* name = "linear";
  static constexpr int radius = 1;
  KOKKOS_FORCEINLINE_FUNCTION static double weight(int d) { return d == 0 ? 1 : 0.5; }
};

/// The refinement of quadratic B-splines about nodes: 3/4, 1/2, 1/8.
struct QuadraticEmbedding {
  static constexpr char const* name = "quadratic";
  static constexpr int radius = 2;
  KOKKOS_FORCEINLINE_FUNCTION static double weight(int d) {
    return d == 0 ? 0.75 : d == 1 || d == -1 ? 0.5 : 0.125;
  }
};

/// Which nodes are fixed, not 0 where they are; or empty where none is.
template <class S>
using FixedNodes = Kokkos::View<std::uint8_t const*, typename S::memory>;

namespace kernels {

template <class S>
KOKKOS_FORCEINLINE_FUNCTION bool is_fixed(FixedNodes<S> const& fixed, int i) {
  return fixed.extent(0) > 0 && fixed(i) != 0;
}

/// coarse = P' fine
template <class S, class Embedding, class TF, class TC>
struct Restrict {
  GridNodes<S> fine, coarse;
  FixedNodes<S> fixed;  ///< of the fine level
  VectorField<TF, S> from;
  VectorField<TC, S> to;
  KOKKOS_FUNCTION void operator()(int i) const { set_vector(to, i, sum(i)); }
  [[gnu::noinline]] KOKKOS_FUNCTION Vec3<TC> sum(int i) const {
    constexpr int r = Embedding::radius;
    Vec3<TC> total{0, 0, 0};
    int const x = 2 * coarse.ijk(i, 0), y = 2 * coarse.ijk(i, 1), z = 2 * coarse.ijk(i, 2);
    for (int a = -r; a <= r; ++a)
      for (int b = -r; b <= r; ++b)
        for (int c = -r; c <= r; ++c) {
          int const f = fine.node(x + a, y + b, z + c);
          if (f < 0 || is_fixed<S>(fixed, f)) continue;
          TC const w = TC(Embedding::weight(a) * Embedding::weight(b) * Embedding::weight(c));
          for (int k = 0; k < 3; ++k) total[k] += w * TC(from(f, k));
        }
    return total;
  }
};

/// fine += P coarse
template <class S, class Embedding, class TF, class TC>
struct Prolong {
  GridNodes<S> fine, coarse;
  FixedNodes<S> fixed;  ///< of the fine level
  VectorField<TC, S> from;
  VectorField<TF, S> to;
  KOKKOS_FUNCTION void operator()(int f) const {
    if (is_fixed<S>(fixed, f)) return;
    Vec3<TC> const added = sum(f);
    for (int k = 0; k < 3; ++k) to(f, k) += TF(added[k]);
  }
  [[gnu::noinline]] KOKKOS_FUNCTION Vec3<TC> sum(int f) const {
    constexpr int r = Embedding::radius;
    Vec3<TC> total{0, 0, 0};
    int const x = fine.ijk(f, 0), y = fine.ijk(f, 1), z = fine.ijk(f, 2);
    // The coarse nodes c with |f - 2c| <= r.
    for (int i = (x - r + 1) >> 1; 2 * i <= x + r; ++i)
      for (int j = (y - r + 1) >> 1; 2 * j <= y + r; ++j)
        for (int k = (z - r + 1) >> 1; 2 * k <= z + r; ++k) {
          int const n = coarse.node(i, j, k);
          if (n < 0) continue;  // of a fine node that is fixed
          TC const w = TC(Embedding::weight(x - 2 * i) * Embedding::weight(y - 2 * j) *
                          Embedding::weight(z - 2 * k));
          for (int c = 0; c < 3; ++c) total[c] += w * from(n, c);
        }
    return total;
  }
};

/// The bits of the nodes of a leaf that are free.
template <class S>
struct FreeNodes {
  GridNodes<S> nodes;
  FixedNodes<S> fixed;
  typename GridNodes<S>::template PerLeaf<std::uint64_t* [8]> mask;
  KOKKOS_FUNCTION void operator()(int l) const {
    int node = nodes.begin(l);
    for (int x = 0; x < 8; ++x) {
      std::uint64_t free = nodes.mask(l, x);
      for (std::uint64_t rest = free; rest != 0; rest &= rest - 1, ++node)
        if (fixed(node) != 0) free &= ~(rest & (~rest + 1));
      mask(l, x) = free;
    }
  }
};

}  // namespace kernels

/// coarse = P' fine, where fixed nodes of the fine level have no part in P.
template <class Embedding, class S, class TF, class TC>
void restrict_to(GridNodes<S> const& fine_nodes, FixedNodes<S> const& fixed,
                 VectorField<TF, S> const& fine, GridNodes<S> const& coarse_nodes,
                 VectorField<TC, S> const& coarse) {
  for_each<S>(
      "restrict", coarse_nodes.count,
      kernels::Restrict<S, Embedding, TF, TC>{fine_nodes, coarse_nodes, fixed, fine, coarse});
}

/// fine += P coarse.
template <class Embedding, class S, class TF, class TC>
void add_prolonged(GridNodes<S> const& coarse_nodes, VectorField<TC, S> const& coarse,
                   GridNodes<S> const& fine_nodes, FixedNodes<S> const& fixed,
                   VectorField<TF, S> const& fine) {
  for_each<S>(
      "prolong", fine_nodes.count,
      kernels::Prolong<S, Embedding, TF, TC>{fine_nodes, coarse_nodes, fixed, coarse, fine});
}

}  // namespace taut
