#include <taut/core/fem/connected.hpp>
#include <taut/core/fem/ordering.hpp>

#include <algorithm>
#include <numeric>

namespace taut {

namespace {

constexpr int bits = 16;  // per axis: a curve through 2^48 cells

// Index along the Hilbert curve by transposing bits (Skilling 2004).
std::uint64_t hilbert_index(std::array<std::uint32_t, 3> x) {
  for (std::uint32_t q = 1u << (bits - 1); q > 1; q >>= 1) {
    std::uint32_t const low = q - 1;
    for (int i = 0; i < 3; ++i) {
      if (x[i] & q) {
        x[0] ^= low;
      } else {
        std::uint32_t const t = (x[0] ^ x[i]) & low;
        x[0] ^= t;
        x[i] ^= t;
      }
    }
  }
  x[1] ^= x[0];
  x[2] ^= x[1];
  std::uint32_t t = 0;
  for (std::uint32_t q = 1u << (bits - 1); q > 1; q >>= 1) {
    if (x[2] & q) t ^= q - 1;
  }
  std::uint64_t index = 0;
  for (int b = bits - 1; b >= 0; --b) {
    for (int i = 0; i < 3; ++i) index = (index << 1) | (((x[i] ^ t) >> b) & 1u);
  }
  return index;
}

}  // namespace

Ordering locality_order(TetMesh const& mesh, std::span<std::int32_t const> group) {
  Point low = {1e300, 1e300, 1e300}, high = {-1e300, -1e300, -1e300};
  for (Point const& p : mesh.points) {
    for (int c = 0; c < 3; ++c) {
      low[c] = std::min(low[c], p[c]);
      high[c] = std::max(high[c], p[c]);
    }
  }
  double extent = 0;
  for (int c = 0; c < 3; ++c) extent = std::max(extent, high[c] - low[c]);
  double const to_cells = extent > 0 ? ((1 << bits) - 1) / (4 * extent) : 0;

  std::size_t const count = mesh.tets.size();
  std::vector<std::uint64_t> key(count);
  for (std::size_t t = 0; t < count; ++t) {
    std::array<std::uint32_t, 3> cell;
    for (int c = 0; c < 3; ++c) {
      double sum = 0;
      for (std::int32_t v : mesh.tets[t]) sum += mesh.points[v][c] - low[c];
      cell[c] = static_cast<std::uint32_t>(sum * to_cells);
    }
    key[t] = hilbert_index(cell);
  }

  // A body is where the first of its tets is along the curve.
  std::vector<std::int32_t> const body = smallest_connected(mesh.points.size(), mesh.tets);
  std::vector<std::uint64_t> first(mesh.points.size(), ~std::uint64_t(0));
  for (std::size_t t = 0; t < count; ++t) {
    std::uint64_t& least = first[body[mesh.tets[t][0]]];
    least = std::min(least, key[t]);
  }

  Ordering order;
  order.tets.resize(count);
  std::iota(order.tets.begin(), order.tets.end(), 0);
  std::sort(order.tets.begin(), order.tets.end(), [&](std::int32_t a, std::int32_t b) {
    if (!group.empty() && group[a] != group[b]) return group[a] < group[b];
    std::int32_t const of_a = body[mesh.tets[a][0]], of_b = body[mesh.tets[b][0]];
    if (of_a != of_b) return first[of_a] != first[of_b] ? first[of_a] < first[of_b] : of_a < of_b;
    return key[a] != key[b] ? key[a] < key[b] : a < b;
  });

  order.new_vertex.assign(mesh.points.size(), -1);
  order.vertices.reserve(mesh.points.size());
  auto const append = [&](std::int32_t v) {
    if (order.new_vertex[v] >= 0) return;
    order.new_vertex[v] = static_cast<std::int32_t>(order.vertices.size());
    order.vertices.push_back(v);
  };
  for (std::int32_t t : order.tets) {
    for (std::int32_t v : mesh.tets[t]) append(v);
  }
  for (std::size_t v = 0; v < mesh.points.size(); ++v) append(static_cast<std::int32_t>(v));
  return order;
}

}  // namespace taut
