#include <taut/contact/box_tree.hpp>

#include <algorithm>
#include <numeric>

namespace taut {

Box Box::around(std::span<Point const> points) {
  Box box{points[0], points[0]};
  for (Point const& x : points) box.include({x, x});
  return box;
}

void Box::include(Box const& other) {
  for (std::size_t c = 0; c < 3; ++c) {
    low[c] = std::min(low[c], other.low[c]);
    high[c] = std::max(high[c], other.high[c]);
  }
}

bool Box::overlaps(Box const& other) const {
  bool overlap = true;
  for (std::size_t c = 0; c < 3; ++c)
    overlap = overlap && low[c] <= other.high[c] && other.low[c] <= high[c];
  return overlap;
}

namespace {
constexpr std::int32_t leaf_size = 4;
}

BoxTree::BoxTree(std::span<Box const> boxes)
    : boxes_(boxes.begin(), boxes.end()), order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  if (boxes_.empty()) return;
  nodes_.reserve(boxes_.size());
  build(0, static_cast<std::int32_t>(boxes_.size()));
}

std::int32_t BoxTree::build(std::int32_t first, std::int32_t count) {
  auto const id = nodes_.size();
  auto const begin = order_.begin() + first, end = begin + count;
  Box box = boxes_[*begin];
  for (auto item = begin; item != end; ++item) box.include(boxes_[*item]);
  nodes_.push_back({box, first, count, 0});
  if (count > leaf_size) {
    std::size_t axis = 0;
    for (std::size_t c = 1; c < 3; ++c)
      if (box.high[c] - box.low[c] > box.high[axis] - box.low[axis]) axis = c;
    // Halves, as their middle may overflow. Equal middles are halved like others: the depth is
    // log2 of the number of boxes, even if they are all the same.
    const auto middle = [&](std::int32_t item) {
      Box const& b = boxes_[item];
      return b.low[axis] / 2 + b.high[axis] / 2;
    };
    std::int32_t const half = count / 2;
    std::nth_element(begin, begin + half, end, [&](std::int32_t i, std::int32_t j) {
      return std::pair(middle(i), i) < std::pair(middle(j), j);
    });
    build(first, half);
    nodes_[id].second = build(first + half, count - half);
  }
  return static_cast<std::int32_t>(id);
}

void BoxTree::find(Box const& box, std::vector<std::int32_t>& found) const {
  found.clear();
  if (nodes_.empty()) return;
  std::array<std::int32_t, 64> waiting;  // one per level at most
  std::size_t waits = 0;
  waiting[waits++] = 0;
  while (waits > 0) {
    std::int32_t const id = waiting[--waits];
    Node const& node = nodes_[id];
    if (!node.box.overlaps(box)) continue;
    if (node.second > 0) {
      waiting[waits++] = node.second;
      waiting[waits++] = id + 1;
      continue;
    }
    for (std::int32_t k = node.first; k < node.first + node.count; ++k) {
      std::int32_t const item = order_[k];
      if (boxes_[item].overlaps(box)) found.push_back(item);
    }
  }
  std::sort(found.begin(), found.end());
}

}  // namespace taut
