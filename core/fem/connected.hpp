// Which vertices are connected through simplices that share them (union-find with halved paths:
// R. E. Tarjan, J. van Leeuwen, "Worst-case analysis of set union algorithms", J. ACM 31, 1984).
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace taut {

/// Per vertex: the smallest vertex that it is connected with, itself included.
template <std::size_t n>
std::vector<std::int32_t> smallest_connected(
    std::size_t vertices, std::span<std::array<std::int32_t, n> const> simplices) {
  std::vector<std::int32_t> parent(vertices);
  std::iota(parent.begin(), parent.end(), 0);
  auto const up = [&](std::int32_t v) -> std::int32_t& { return parent[v]; };
  auto const root = [&](std::int32_t v) {
    while (up(v) != v) v = up(v) = up(up(v));
    return v;
  };
  for (auto const& simplex : simplices)
    for (std::int32_t const v : simplex) {
      std::int32_t const a = root(simplex[0]), b = root(v);
      up(std::max(a, b)) = std::min(a, b);
    }
  // A parent is never larger than its child, so that it is a root by now.
  for (std::int32_t& v : parent) v = up(v);
  return parent;
}
template <std::size_t n>
std::vector<std::int32_t> smallest_connected(
    std::size_t vertices, std::vector<std::array<std::int32_t, n>> const& simplices) {
  return smallest_connected(vertices, std::span<std::array<std::int32_t, n> const>(simplices));
}

}  // namespace taut
