// Which nodes of a grid exist: a sparse set of integer points, held in an OpenVDB tree (Museth
// 2013) whose leaves are cubes of 8^3 bits. This is the host's side of a grid level: dilation by
// the reach of a kernel, the nodes of the next coarser level, and the order in which nodes are
// numbered.
//
// A set that is cleared keeps its leaves, so that a grid that moves little from step to step
// allocates little; they are let go once most of them are empty.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace taut {

/// The nodes of a leaf: bit 8 y + z of word x.
using LeafMask = std::array<std::uint64_t, 8>;

/// The leaves of a set that are not empty, in the order of the tree, which depends on the set
/// alone.
struct LeafList {
  std::vector<std::array<int, 3>> origin;  ///< lowest node, multiples of 8
  std::vector<LeafMask> mask;

  int size() const { return static_cast<int>(origin.size()); }
  void clear() {
    origin.clear();
    mask.clear();
  }
};

class Topology {
public:
  /// Coordinates of nodes are at most this, of either sign: sums of two of them, and what a kernel
  /// reaches from one, are ints.
  static constexpr int farthest = 1 << 29;

  Topology();
  ~Topology();
  Topology(Topology&&) noexcept;
  Topology& operator=(Topology&&) noexcept;

  /// The empty set.
  void clear();
  /// Adds the nodes of a leaf.
  void add(std::array<int, 3> const& origin, LeafMask const& mask);
  /// Becomes the nodes that lie `width` - 1 or less above a node of `from` along each axis: what
  /// kernels of `width` nodes (2 to 4) reach that begin at those.
  void reach(LeafList const& from, int width);
  /// Becomes the nodes of the level with twice the spacing, where node c lies on node 2c of `from`,
  /// that are within `radius` (1 or 2) of a node of `from` along each axis: those that the node
  /// is interpolated from.
  void coarsen(LeafList const& from, int radius);

  /// The leaves that are not empty.
  void list(LeafList& leaves) const;

private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace taut
