// Which nodes of a grid a matrix couples, without its numbers: blocks of 3x3 that may be other than
// zero, for the Hessian of material points on a grid of any spacing and for P'AP with the linear
// embedding of multigrid.
#pragma once

#include <taut/core/math/matrix.hpp>

#include <array>
#include <bitset>
#include <cstdint>
#include <vector>

namespace taut {

/// Coordinates of a node in units of the spacing.
using NodeAt = std::array<int, 3>;

/// Couplings reach two nodes along each axis: kernels of quadratic splines have three nodes, and in
/// P'AP 1 + 2 + 1 fine nodes are two coarse ones.
struct NodePattern {
  static constexpr int reach = 2, width = 2 * reach + 1;
  std::vector<NodeAt> nodes;                                ///< ascending
  std::vector<std::bitset<width * width * width>> coupled;  ///< of each node; see bit()

  static constexpr int bit(int dx, int dy, int dz) {
    return ((dx + reach) * width + dy + reach) * width + dz + reach;
  }
  static constexpr NodeAt offset(int bit) {
    return {bit / (width * width) - reach, bit / width % width - reach, bit % width - reach};
  }
  /// The number of a node; -1 if there is none.
  int find(NodeAt const& at) const;
  /// Blocks of 3x3 that may be other than zero.
  std::int64_t blocks() const;
};

/// Nodes that quadratic splines of points at x reach, coupled where they reach a point in common.
NodePattern pattern_of_points(std::vector<Vec3<double>> const& x, double spacing);

/// P'AP: node I of twice the spacing is at the place of fine node 2 I, and there is one for every
/// fine node that it is interpolated to.
NodePattern coarser_pattern(NodePattern const& fine);

}  // namespace taut
