// The locality-preserving order of a mesh: a permutation that keeps parts together and neighbours
// close, and the way back from it.
#include <taut/core/fem/ordering.hpp>
#include <taut/core/fem/shapes.hpp>

#include <catch2/catch_test_macros.hpp>

#include <algorithm>
#include <cmath>
#include <random>

using namespace taut;

namespace {

bool is_permutation_of(std::vector<std::int32_t> values, std::size_t n) {
  std::sort(values.begin(), values.end());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] != static_cast<std::int32_t>(i)) return false;
  }
  return values.size() == n;
}

void check_permutation(Ordering const& order, TetMesh const& mesh) {
  CHECK(is_permutation_of(order.tets, mesh.tets.size()));
  CHECK(is_permutation_of(order.vertices, mesh.points.size()));
  REQUIRE(order.new_vertex.size() == mesh.points.size());
  bool inverse = true;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    inverse = inverse && order.vertices[order.new_vertex[v]] == static_cast<std::int32_t>(v);
  }
  CHECK(inverse);
}

/// The mean distance in memory between the vertices of a tet.
double mean_span(TetMesh const& mesh, std::vector<std::int32_t> const& new_vertex) {
  double sum = 0;
  for (Tet const& tet : mesh.tets) {
    std::int32_t low = new_vertex[tet[0]], high = low;
    for (std::int32_t v : tet) {
      low = std::min(low, new_vertex[v]);
      high = std::max(high, new_vertex[v]);
    }
    sum += high - low;
  }
  return sum / static_cast<double>(mesh.tets.size());
}

TetMesh shuffled_box(int resolution) {
  TetMesh mesh = make_shape(BoxShape{{1, 1.2, 0.9}}, resolution);
  std::mt19937 random(2);
  std::shuffle(mesh.tets.begin(), mesh.tets.end(), random);
  return mesh;
}

}  // namespace

TEST_CASE("the order is a permutation, and new_vertex its inverse", "[fem]") {
  TetMesh mesh = shuffled_box(8);
  mesh.points.push_back({7, 7, 7});  // a vertex without a tet
  Ordering const order = locality_order(mesh);
  check_permutation(order, mesh);
  CHECK(order.vertices.back() == static_cast<std::int32_t>(mesh.points.size()) - 1);
  // Vertices by first use.
  std::int32_t next = 0;
  for (std::int32_t t : order.tets) {
    for (std::int32_t v : mesh.tets[t]) {
      CHECK(order.new_vertex[v] <= next);
      if (order.new_vertex[v] == next) ++next;
    }
  }
}

TEST_CASE("parts stay together, in ascending order", "[fem]") {
  TetMesh const mesh = shuffled_box(6);
  std::vector<std::int32_t> group(mesh.tets.size());
  for (std::size_t t = 0; t < group.size(); ++t) group[t] = static_cast<std::int32_t>(t * 7 % 5);
  Ordering const order = locality_order(mesh, group);
  check_permutation(order, mesh);
  CHECK(std::is_sorted(order.tets.begin(), order.tets.end(),
                       [&](std::int32_t a, std::int32_t b) { return group[a] < group[b]; }));
}

TEST_CASE("neighbours in space are close in the order", "[fem]") {
  // n vertices in a Hilbert curve's order: a tet spans some n^(2/3) of them, and not n.
  for (int resolution : {8, 16}) {
    TetMesh const mesh = shuffled_box(resolution);
    double const n = static_cast<double>(mesh.points.size());
    CHECK(mean_span(mesh, locality_order(mesh).new_vertex) < 2 * std::pow(n, 2.0 / 3));
  }
}

TEST_CASE("degenerate meshes are ordered, too", "[fem]") {
  TetMesh const empty;
  CHECK(locality_order(empty).tets.empty());
  TetMesh point;  // without an extent
  point.points.assign(4, Point{1, 2, 3});
  point.tets.assign(3, Tet{0, 1, 2, 3});
  Ordering const order = locality_order(point);
  check_permutation(order, point);
  CHECK(order.tets == std::vector<std::int32_t>{0, 1, 2});
}
