#include <taut/mpm/topology.hpp>

#include <openvdb/Types.h>
#include <openvdb/tree/LeafNodeMask.h>
#include <openvdb/tree/Tree.h>

#include <algorithm>
#include <cstdlib>

namespace taut {
namespace {

using MaskTree = openvdb::tree::Tree4<openvdb::ValueMask, 5, 4, 3>::Type;
using Word = std::uint64_t;

/// A box of bits: bit z of row[x][y] is the node `low` + (x, y, z).
struct BitBox {
  static constexpr int longest = 11;  ///< a leaf and three nodes more
  int low[3];
  int width;
  std::uint32_t row[longest][longest];
};

/// The lowest node of the leaf that `i` lies in.
int leaf_origin(int i) { return i & ~7; }

}  // namespace

struct Topology::Tree {
  MaskTree tree{false};

  /// Adds the nodes of a box, leaf by leaf.
  void merge(BitBox const& box) {
    int const *const low = box.low, width = box.width;
    for (int x = leaf_origin(low[0]); x < low[0] + width; x += 8)
      for (int y = leaf_origin(low[1]); y < low[1] + width; y += 8)
        for (int z = leaf_origin(low[2]); z < low[2] + width; z += 8) merge(box, {x, y, z});
  }

  void merge(BitBox const& box, std::array<int, 3> const& origin) {
    int const dx = origin[0] - box.low[0], dy = origin[1] - box.low[1], dz = origin[2] - box.low[2];
    LeafMask mask{};
    Word any = 0;
    for (int x = std::max(0, -dx); x < std::min(8, box.width - dx); ++x) {
      for (int y = std::max(0, -dy); y < std::min(8, box.width - dy); ++y) {
        Word const row = box.row[x + dx][y + dy];
        mask[x] |= ((dz >= 0 ? row >> dz : row << -dz) & 0xff) << 8 * y;
      }
      any |= mask[x];
    }
    if (any != 0) merge(origin, mask);
  }

  void merge(std::array<int, 3> const& origin, LeafMask const& mask) {
    auto* const leaf = tree.touchLeaf({origin[0], origin[1], origin[2]});
    auto& words = leaf->getValueMask();
    for (int x = 0; x < 8; ++x) words.getWord<Word>(x) |= mask[x];
  }
};

Topology::Topology() : tree_(std::make_unique<Tree>()) {}
Topology::~Topology() = default;
Topology::Topology(Topology&&) noexcept = default;
Topology& Topology::operator=(Topology&&) noexcept = default;

void Topology::clear() {
  int leaves = 0, empty = 0;
  for (auto leaf = tree_->tree.beginLeaf(); leaf; ++leaf, ++leaves) empty += leaf->isEmpty();
  if (2 * empty > leaves) {
    tree_->tree.clear();
    return;
  }
  for (auto leaf = tree_->tree.beginLeaf(); leaf; ++leaf) leaf->getValueMask().setOff();
}

void Topology::add(std::array<int, 3> const& origin, LeafMask const& mask) {
  tree_->merge(origin, mask);
}

void Topology::reach(LeafList const& from, int width) {
  clear();
  for (int l = 0; l < from.size(); ++l) {
    auto const& o = from.origin[l];
    // One axis after the other: along z within a row, then rows along y, then along x.
    BitBox box{{o[0], o[1], o[2]}, 8 + width - 1, {}};
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y) {
        std::uint32_t const row = from.mask[l][x] >> 8 * y & 0xff;
        std::uint32_t reached = 0;
        for (int s = 0; s < width; ++s) reached |= row << s;
        for (int s = 0; s < width; ++s) box.row[x][y + s] |= reached;
      }
    for (int x = box.width - 1; x >= 0; --x)
      for (int s = 1; s < width && s <= x; ++s)
        for (int y = 0; y < box.width; ++y) box.row[x][y] |= box.row[x - s][y];
    tree_->merge(box);
  }
}

void Topology::coarsen(LeafList const& from, int radius) {
  clear();
  // Coarse node c is near fine node f where |f - 2c| <= radius: for the nodes 0 to 7 of a leaf that
  // begins at o, c - (o / 2 - 1) is in [0, 6).
  std::uint32_t near[8];
  for (int f = 0; f < 8; ++f) {
    near[f] = 0;
    for (int c = -1; c < 5; ++c) near[f] |= std::uint32_t(std::abs(f - 2 * c) <= radius) << (c + 1);
  }
  for (int l = 0; l < from.size(); ++l) {
    auto const& o = from.origin[l];
    BitBox box{{o[0] / 2 - 1, o[1] / 2 - 1, o[2] / 2 - 1}, 6, {}};
    for (int x = 0; x < 8; ++x)
      for (int y = 0; y < 8; ++y) {
        std::uint32_t row = 0;
        for (int z = 0; z < 8; ++z)
          if ((from.mask[l][x] >> (8 * y + z) & 1) != 0) row |= near[z];
        if (row == 0) continue;
        for (int cx = 0; cx < 6; ++cx)
          for (int cy = 0; cy < 6; ++cy)
            if ((near[x] >> cx & near[y] >> cy & 1) != 0) box.row[cx][cy] |= row;
      }
    tree_->merge(box);
  }
}

void Topology::list(LeafList& leaves) const {
  leaves.clear();
  for (auto leaf = tree_->tree.cbeginLeaf(); leaf; ++leaf) {
    if (leaf->isEmpty()) continue;
    openvdb::Coord const& o = leaf->origin();
    leaves.origin.push_back({o.x(), o.y(), o.z()});
    LeafMask& mask = leaves.mask.emplace_back();
    for (int x = 0; x < 8; ++x) mask[x] = leaf->getValueMask().getWord<Word>(x);
  }
}

}  // namespace taut
