// Axis-aligned boxes, and a tree of them that finds those that overlap a given one: the culling of
// the exact intersection test. Its own, so that it shares no mistake with the broad phase of
// contact; halved by the number of boxes along the longest side, so that n boxes take n log n,
// whatever their places.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

#include <span>

namespace taut {

/// Closed: boxes that share a point of their surface overlap.
struct Box {
  Point low, high;

  /// The smallest box around the points.
  static Box around(std::span<Point const> points);
  void include(Box const& other);
  bool overlaps(Box const& other) const;
};

class BoxTree {
public:
  explicit BoxTree(std::span<Box const> boxes);

  /// Replaces `found` by the numbers of the boxes that overlap `box`, ascending.
  void find(Box const& box, std::vector<std::int32_t>& found) const;

private:
  /// Its items are order_[first, first + count). An inner node's children are the next node and
  /// node `second`.
  struct Node {
    Box box;
    std::int32_t first, count;
    std::int32_t second;  ///< 0: a leaf
  };

  std::int32_t build(std::int32_t first, std::int32_t count);

  std::vector<Box> boxes_;
  std::vector<std::int32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace taut
