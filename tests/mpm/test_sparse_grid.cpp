// The sparse grid against std::set: every place of every kernel, one at a time.
#include <catch2/catch_test_macros.hpp>
#include <taut/mpm/sparse_grid.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <set>

#include "support/threads.hpp"

namespace {

using namespace taut;
using Place = std::array<int, 3>;
using Left = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutLeft>;
using Right = Space<Kokkos::DefaultHostExecutionSpace, Kokkos::LayoutRight>;

template <class S>
typename SparseGrid<S>::BaseNodes bases(std::vector<Place> const& places) {
  Kokkos::View<int* [3], typename S::layout, typename S::memory> view("bases", places.size());
  for (std::size_t p = 0; p < places.size(); ++p)
    for (int c = 0; c < 3; ++c) view(p, c) = places[p][c];
  return view;
}

template <class S>
void rebuild(SparseGrid<S>& grid, std::vector<Place> const& places, int width) {
  grid.rebuild(bases<S>(places), static_cast<int>(places.size()), width, 0.25);
}

std::set<Place> reached(std::vector<Place> const& places, int width) {
  std::set<Place> nodes;
  for (Place const& p : places)
    for (int x = 0; x < width; ++x)
      for (int y = 0; y < width; ++y)
        for (int z = 0; z < width; ++z) nodes.insert({p[0] + x, p[1] + y, p[2] + z});
  return nodes;
}

/// What node c of the coarser level stands for, in the words of the hierarchy: a fine node is
/// interpolated from it.
std::set<Place> parents(std::set<Place> const& fine, int radius) {
  std::set<Place> nodes;
  for (Place const& f : fine) {
    std::vector<int> axis[3];
    for (int a = 0; a < 3; ++a)
      for (int c = f[a] / 2 - 3; c <= f[a] / 2 + 3; ++c)
        if (std::abs(f[a] - 2 * c) <= radius) axis[a].push_back(c);
    for (int x : axis[0])
      for (int y : axis[1])
        for (int z : axis[2]) nodes.insert({x, y, z});
  }
  return nodes;
}

template <class S>
std::vector<Place> numbered(GridNodes<S> const& nodes) {
  std::vector<Place> places;
  for (int i = 0; i < nodes.count; ++i) {
    places.push_back({nodes.ijk(i, 0), nodes.ijk(i, 1), nodes.ijk(i, 2)});
  }
  return places;
}

/// Everything that a grid says, against the set of its nodes.
template <class S>
void check(GridNodes<S> const& nodes, std::set<Place> const& expected) {
  REQUIRE(nodes.count == static_cast<int>(expected.size()));
  auto const places = numbered(nodes);
  CHECK(std::set<Place>(places.begin(), places.end()) == expected);
  int wrong = 0;
  for (int i = 0; i < nodes.count; ++i) {
    auto const [x, y, z] = places[i];
    int const l = nodes.leaf(i);
    wrong += nodes.node(x, y, z) != i || nodes.leaves.find(x, y, z) != l ||
             nodes.in_leaf(l, x, y, z) != i || i < nodes.begin(l) || i >= nodes.begin(l + 1);
    // The places around, there or not, across the border of the leaf.
    for (int a = -3; a <= 3; ++a)
      for (int b = -3; b <= 3; ++b)
        for (int c = -3; c <= 3; ++c) {
          int const n = nodes.node(x + a, y + b, z + c);
          wrong += n != nodes.near(l, x + a, y + b, z + c);
          wrong += (n >= 0) != expected.contains({x + a, y + b, z + c});
          wrong += n >= 0 && places[n] != Place{x + a, y + b, z + c};
        }
  }
  CHECK(wrong == 0);
  CHECK(nodes.begin(nodes.leaves.count) == nodes.count);
  for (int l = 0; l < nodes.leaves.count; ++l) {
    CHECK(nodes.begin(l) < nodes.begin(l + 1));  // no leaf is empty
    for (int c = 0; c < 3; ++c) CHECK(nodes.leaves.origin(l, c) % 8 == 0);
  }
}

std::vector<Place> cloud(int count, int spread, Place const& centre, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> uniform(-spread, spread);
  std::vector<Place> places(count);
  for (Place& p : places)
    for (int c = 0; c < 3; ++c) p[c] = centre[c] + uniform(random);
  return places;
}

template <class S>
void check_all_widths(std::vector<Place> const& places) {
  for (int width = 2; width <= 4; ++width) {
    CAPTURE(width);
    SparseGrid<S> grid;
    rebuild(grid, places, width);
    CHECK(grid.nodes().dx == 0.25);
    std::set<Place> nodes = reached(places, width);
    check(grid.nodes(), nodes);
    for (int radius = 1; radius <= 2; ++radius) {
      GridLevel<S> level[3];
      LeafList const* finer = &grid.leaves();
      double dx = 0.25;
      std::set<Place> coarse = nodes;
      for (GridLevel<S>& l : level) {
        l.coarsen(*finer, radius, dx);
        coarse = parents(coarse, radius);
        check(l.nodes(), coarse);
        CHECK(l.nodes().dx == 2 * dx);
        dx *= 2;
        finer = &l.leaves();
      }
    }
  }
}

}  // namespace

TEST_CASE("a grid has the nodes that kernels reach, and coarse grids their parents",
          "[sparse_grid]") {
  SECTION("one particle, in each corner of a leaf and on either side of zero") {
    for (int x : {-9, -8, -1, 0, 5, 7})
      for (int z : {-2, 6}) check_all_widths<Right>({{x, -8, z}});
  }
  SECTION("a cloud around the origin") { check_all_widths<Right>(cloud(300, 12, {0, 0, 0}, 1)); }
  SECTION("the layout of a device") { check_all_widths<Left>(cloud(200, 9, {-3, 4, 0}, 2)); }
  SECTION("scattered, as far as an int can count") {
    auto places = cloud(40, Topology::farthest, {0, 0, 0}, 3);
    int const far = Topology::farthest;
    places.push_back({far, -far, far});
    places.push_back({-far, far, -far});
    check_all_widths<Right>(places);
  }
}

TEST_CASE("a grid without particles is empty", "[sparse_grid]") {
  SparseGrid<Right> grid;
  CHECK(grid.nodes().node(0, 0, 0) == -1);
  rebuild(grid, {}, 3);
  CHECK(grid.nodes().count == 0);
  CHECK(grid.nodes().leaves.count == 0);
  CHECK(grid.nodes().node(0, 0, 0) == -1);
  GridLevel<Right> coarse;
  coarse.coarsen(grid.leaves(), 1, 0.25);
  CHECK(coarse.nodes().count == 0);
  // And becomes so again.
  rebuild(grid, {{1, 2, 3}}, 3);
  CHECK(grid.nodes().count == 27);
  rebuild(grid, {}, 3);
  CHECK(grid.nodes().count == 0);
  CHECK(grid.nodes().node(1, 2, 3) == -1);
}

TEST_CASE("nodes have the same numbers whatever the order of particles, the threads and the past",
          "[sparse_grid]") {
  auto places = cloud(5000, 40, {7, -9, 100}, 4);
  SparseGrid<Right> fresh;
  rebuild(fresh, places, 3);
  auto const expected = numbered(fresh.nodes());

  SparseGrid<Right> used;
  rebuild(used, cloud(500, 90, {0, 0, 0}, 5), 3);
  std::mt19937 random(6);
  for (int trial = 0; trial < 3; ++trial) {
    std::shuffle(places.begin(), places.end(), random);
    rebuild(used, places, 3);
    CHECK(numbered(used.nodes()) == expected);
  }
  test::on_one_thread([&] { rebuild(used, places, 3); });
  CHECK(numbered(used.nodes()) == expected);
}

TEST_CASE("a grid follows particles that move, and forgets where they were", "[sparse_grid]") {
  SparseGrid<Right> grid;
  auto places = cloud(100, 6, {0, 0, 0}, 7);
  for (int step = 0; step < 30; ++step) {
    for (Place& p : places) p = {p[0] + 5, p[1] - 3, p[2] + (step % 2 == 0 ? 9 : -9)};
    rebuild(grid, places, 3);
    REQUIRE(grid.nodes().count == static_cast<int>(reached(places, 3).size()));
  }
  check(grid.nodes(), reached(places, 3));
}

TEST_CASE("a grid that does not grow keeps its memory", "[sparse_grid]") {
  SparseGrid<Right> grid;
  auto const places = cloud(2000, 20, {0, 0, 0}, 8);
  rebuild(grid, places, 3);
  auto const* const before = grid.nodes().ijk.data();
  auto const* const masks = grid.nodes().mask.data();
  rebuild(grid, {places.begin(), places.begin() + 500}, 3);
  CHECK(grid.nodes().ijk.data() == before);
  rebuild(grid, places, 3);
  CHECK(grid.nodes().ijk.data() == before);
  CHECK(grid.nodes().mask.data() == masks);
}

TEST_CASE("a grid refuses what it cannot hold", "[sparse_grid]") {
  SparseGrid<Right> grid;
  auto const fails = [&](std::vector<Place> const& places, int width, double dx, char const* why) {
    try {
      grid.rebuild(bases<Right>(places), static_cast<int>(places.size()), width, dx);
    } catch (Error const& e) {
      CHECK(std::string(e.what()).find(why) != std::string::npos);
      return true;
    }
    return false;
  };
  CHECK(fails({{0, 0, 0}, {0, Topology::farthest + 1, 0}}, 3, 1, "particle 1"));
  CHECK(fails({{std::numeric_limits<int>::min(), 0, 0}}, 3, 1, "particle 0"));
  CHECK(fails({{0, 0, 0}}, 1, 1, "2 to 4"));
  CHECK(fails({{0, 0, 0}}, 5, 1, "2 to 4"));
  CHECK(fails({{0, 0, 0}}, 3, 0, "spacing"));
  CHECK(fails({{0, 0, 0}}, 3, std::numeric_limits<double>::quiet_NaN(), "spacing"));
  CHECK_THROWS_AS(grid.rebuild(bases<Right>({{0, 0, 0}}), 2, 3, 1.0), Error);
  CHECK_FALSE(fails({{0, 0, 0}}, 3, 1, ""));
}
