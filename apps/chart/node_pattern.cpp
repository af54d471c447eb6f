#include <taut/apps/chart/node_pattern.hpp>

#include <algorithm>
#include <cmath>

namespace taut {
namespace {

using Row = std::bitset<NodePattern::width * NodePattern::width * NodePattern::width>;

NodeAt sum(NodeAt const& a, NodeAt const& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

template <class T>
void make_unique_sorted(std::vector<T>& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

/// Coarse coordinates that a fine one is interpolated from.
struct Parents {
  int first, count;
  explicit Parents(int fine) {
    bool const even = fine % 2 == 0;
    first = (fine - (even ? 0 : 1)) / 2;  // exact, whatever the sign
    count = even ? 1 : 2;
  }
};

template <class Visit>
void for_each_parent(NodeAt const& fine, Visit const& visit) {
  Parents const p[3] = {Parents(fine[0]), Parents(fine[1]), Parents(fine[2])};
  for (int x = 0; x < p[0].count; ++x)
    for (int y = 0; y < p[1].count; ++y)
      for (int z = 0; z < p[2].count; ++z)
        visit(NodeAt{p[0].first + x, p[1].first + y, p[2].first + z});
}

}  // namespace

int NodePattern::find(NodeAt const& at) const {
  auto const found = std::lower_bound(nodes.begin(), nodes.end(), at);
  return found != nodes.end() && *found == at ? static_cast<int>(found - nodes.begin()) : -1;
}

std::int64_t NodePattern::blocks() const {
  std::int64_t count = 0;
  for (Row const& row : coupled) count += static_cast<std::int64_t>(row.count());
  return count;
}

NodePattern pattern_of_points(std::vector<Vec3<double>> const& x, double spacing) {
  std::vector<NodeAt> cells;  // the lowest of the 27 nodes that a point reaches
  for (Vec3<double> const& p : x) {
    NodeAt& cell = cells.emplace_back();
    for (int c = 0; c < 3; ++c) cell[c] = static_cast<int>(std::floor(p[c] / spacing - 0.5));
  }
  make_unique_sorted(cells);
  constexpr int nodes = 3;
  auto const for_each_node = [](NodeAt const& cell, auto const& visit) {
    for (int k = 0; k < nodes * nodes * nodes; ++k)
      visit(sum(cell, {k / (nodes * nodes), k / nodes % nodes, k % nodes}));
  };
  NodePattern pattern;
  for (NodeAt const& cell : cells)
    for_each_node(cell, [&](NodeAt const& node) { pattern.nodes.push_back(node); });
  make_unique_sorted(pattern.nodes);
  pattern.coupled.resize(pattern.nodes.size());
  for (NodeAt const& cell : cells) {
    for_each_node(cell, [&](NodeAt const& i) {
      Row& row = pattern.coupled[pattern.find(i)];
      for_each_node(cell, [&](NodeAt const& j) {
        row.set(NodePattern::bit(j[0] - i[0], j[1] - i[1], j[2] - i[2]));
      });
    });
  }
  return pattern;
}

NodePattern coarser_pattern(NodePattern const& fine) {
  NodePattern coarse;
  for (NodeAt const& i : fine.nodes)
    for_each_parent(i, [&](NodeAt const& parent) { coarse.nodes.push_back(parent); });
  make_unique_sorted(coarse.nodes);
  coarse.coupled.resize(coarse.nodes.size());
  for (std::size_t n = 0; n < fine.nodes.size(); ++n) {
    NodeAt const& i = fine.nodes[n];
    // What all parents of i are coupled with.
    std::vector<NodeAt> others;
    for (int bit = 0; bit < static_cast<int>(fine.coupled[n].size()); ++bit) {
      if (!fine.coupled[n][bit]) continue;
      for_each_parent(sum(i, NodePattern::offset(bit)),
                      [&](NodeAt const& parent) { others.push_back(parent); });
    }
    make_unique_sorted(others);
    for_each_parent(i, [&](NodeAt const& parent) {
      Row& row = coarse.coupled[coarse.find(parent)];
      for (NodeAt const& other : others) {
        row.set(NodePattern::bit(other[0] - parent[0], other[1] - parent[1], other[2] - parent[2]));
      }
    });
  }
  return coarse;
}

}  // namespace taut
