// The searches against all pairs there are: none that is close may be missing, whatever the policy,
// the precision, the layout and the number of threads; and all policies give one and the same list.
#include "soups.hpp"

#include <support/data.hpp>
#include <support/threads.hpp>
#include <taut/contact/bvh.hpp>
#include <taut/contact/spatial_hash.hpp>
#include <taut/core/fem/shapes.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

using namespace taut;
using namespace taut::soups;
using Catch::Matchers::ContainsSubstring;
using test::on_one_thread_and_all;

namespace {

using Execution = DefaultSpace::execution;
using Left = Space<Execution, Kokkos::LayoutLeft>;
using Right = Space<Execution, Kokkos::LayoutRight>;

template <class Precision, class S>
Motion<Precision, S> motion_of(Soup const& soup, double alpha) {
  Motion<Precision, S> motion{to_field<typename Precision::position, S>(soup.x)};
  if (alpha > 0) motion.p = to_field<typename Precision::real, S>(soup.p);
  motion.alpha = alpha;
  return motion;
}

template <class Policy, class Precision>
HostCandidates find(Soup const& soup, Motion<Precision, typename Policy::Space> const& motion) {
  using S = typename Policy::Space;
  PairSearch<Policy> search(copy_surface<S>(soup.surface), soup.edge_length);
  Candidates<S> found;
  search.find(motion, soup.radius, found);
  return to_host(found);
}

/// Positions after a part of the motion, rounded to what is stored, as a solver would step.
template <class Precision>
std::vector<Point> after(Soup const& soup, double alpha) {
  using Position = typename Precision::position;
  using Real = typename Precision::real;
  std::vector<Point> x = stored<Position>(soup.x);
  for (std::size_t v = 0; v < x.size(); ++v) {
    for (int c = 0; c < 3; ++c) {
      auto const step =
          static_cast<Real>(static_cast<Real>(alpha) * static_cast<Real>(soup.p[v][c]));
      x[v][c] = static_cast<double>(static_cast<Position>(x[v][c] + double(step)));
    }
  }
  return x;
}

/// Number of pairs that come closer than the radius at x but are not in the list.
std::size_t missing(Soup const& soup, std::vector<Point> const& x, PairSet const& found) {
  std::size_t count = 0;
  all_pairs(soup.surface, [&](Pair const& pair) {
    if (distance(pair, x) < soup.radius && !found.has(pair)) ++count;
  });
  return count;
}

/// The largest gap along an axis between the two parts of a pair over a motion in fp64.
double box_gap(Pair const& pair, std::vector<Point> const& x, std::vector<Point> const& end) {
  int const split = pair.kind == PairKind::point_triangle ? 1 : 2;
  double gap = -std::numeric_limits<double>::infinity();
  for (int c = 0; c < 3; ++c) {
    double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
    for (int a = 0; a < 4; ++a) {
      int const part = a < split ? 0 : 1;
      for (double const y : {x[pair.v[a]][c], end[pair.v[a]][c]}) {
        low[part] = std::min(low[part], y);
        high[part] = std::max(high[part], y);
      }
    }
    gap = std::max({gap, low[1] - high[0], low[0] - high[1]});
  }
  return gap;
}

}  // namespace

TEST_CASE("bounds are rounded to the next float outwards, and no farther", "[contact]") {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr float largest = std::numeric_limits<float>::max();
  std::mt19937_64 random(9);
  std::vector<double> numbers = {
      0.0, -0.0, 1.0, -1.0, double(largest), -double(largest), 1e300, -1e300, infinity, -infinity};
  for (int k = 0; k < 100000; ++k) {
    // Of any size from far below the smallest float on.
    double const exponent = std::uniform_real_distribution<double>(-60, 38)(random);
    double const mantissa = std::uniform_real_distribution<double>(-1, 1)(random);
    numbers.push_back(mantissa * std::pow(10.0, exponent));
    numbers.push_back(double(static_cast<float>(numbers.back())));
  }
  for (double v : numbers) {
    float const down = kernels::round_down(v), up = kernels::round_up(v);
    if (!(double(down) <= v && v <= double(up))) FAIL(v);
    bool const tight = (v > double(largest) || double(std::nextafter(down, largest)) > v) &&
                       (v < -double(largest) || double(std::nextafter(up, -largest)) < v);
    if (v != down && !tight) FAIL(v << " is not as tight as it can be");
  }
}

TEMPLATE_TEST_CASE("no search misses a close pair, and all find the same", "[contact]",
                   (std::pair<Fp64, Left>), (std::pair<Fp64, Right>), (std::pair<Mixed, Right>),
                   (std::pair<Fp32, Left>), (std::pair<Fp32, Right>)) {
  using Precision = typename TestType::first_type;
  using S = typename TestType::second_type;
  std::size_t close = 0;
  // Thousands of small searches: threads would wait for each other most of the time.
  test::on_one_thread([&] {
    for (int kind = 0; kind < static_cast<int>(Kind::count); ++kind) {
      for (int seed = 0; seed < 30; ++seed) {
        Soup const soup = make_soup(static_cast<Kind>(kind), seed);
        double const alpha = seed % 2 == 0 ? 0 : 0.7;
        INFO(soup.name << ", seed " << seed);
        auto const motion = motion_of<Precision, S>(soup, alpha);
        HostCandidates const all = find<BruteForce<S>>(soup, motion);
        CHECK((find<SpatialHash<S>>(soup, motion) == all));
        CHECK((find<Bvh<S>>(soup, motion) == all));

        PairSet const found(all);
        CHECK(found.size() == all.point_triangle.size() + all.edge_edge.size());  // none twice
        for (double part : {0.0, 0.3, 1.0}) {
          if (alpha == 0 && part > 0) continue;
          auto const x = after<Precision>(soup, part * alpha);
          CHECK(missing(soup, x, found) == 0);
          all_pairs(soup.surface, [&](Pair const& p) { close += distance(p, x) < soup.radius; });
        }
      }
    }
  });
  CHECK(close > 50'000);
}

TEMPLATE_TEST_CASE("where a step ends when it is stored counts", "[contact]",
                   BruteForce<DefaultSpace>, SpatialHash<DefaultSpace>, Bvh<DefaultSpace>) {
  // At 7e5 m the numbers of single precision are 1/16 m apart: a point that was to stop 0.093 m
  // above a triangle stops at 1/16 m.
  for (int axis = 0; axis < 3; ++axis) {
    Soup soup;
    soup.surface = make_surface({{0, 1, 2}, {3, 4, 5}}, std::vector<int>(6, 0));
    soup.edge_length = 1;
    soup.radius = 0.07;
    double const end = 1.49 / 16;
    for (Point v : {Point{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2, 0.2, 1}, {1, 0, 3}, {0, 1, 3}}) {
      Point x, p{0, 0, 0};
      for (int c = 0; c < 3; ++c) x[(axis + 1 + c) % 3] = v[c];
      x[axis] += 7e5;
      if (soup.x.size() == 3) p[axis] = end - 1;
      soup.x.push_back(x);
      soup.p.push_back(p);
    }
    Pair const pair{PairKind::point_triangle, {3, 0, 1, 2}};
    REQUIRE(distance(pair, after<Fp32>(soup, 1)) < soup.radius);
    REQUIRE(distance(pair, after<Fp64>(soup, 1)) > soup.radius);
    using S = DefaultSpace;
    CHECK(PairSet(find<TestType>(soup, motion_of<Fp32, S>(soup, 1))).has(pair));
    CHECK(!PairSet(find<TestType>(soup, motion_of<Fp64, S>(soup, 1))).has(pair));
  }
}

TEMPLATE_TEST_CASE("a search finds little more than boxes that are close", "[contact]", Fp64, Mixed,
                   Fp32) {
  using S = DefaultSpace;
  for (Kind kind : {Kind::scattered, Kind::needles, Kind::rods, Kind::strip}) {
    for (int seed = 0; seed < 10; ++seed) {
      Soup const soup = make_soup(kind, seed);
      double const alpha = seed % 2 == 0 ? 0 : 0.7;
      PairSet const found(find<SpatialHash<S>>(soup, motion_of<TestType, S>(soup, alpha)));
      auto const x = after<TestType>(soup, 0), end = after<TestType>(soup, alpha);
      std::size_t wrong = 0;
      all_pairs(soup.surface, [&](Pair const& pair) {
        double const gap = box_gap(pair, x, end);
        // Needles of 20 m in fp32 are given 32 epsilon of that on each side by the budget.
        if (gap < soup.radius ? !found.has(pair) : gap > soup.radius + 5e-4 && found.has(pair)) {
          ++wrong;
        }
      });
      INFO(soup.name << ", seed " << seed);
      CHECK(wrong == 0);
    }
  }
}

TEMPLATE_TEST_CASE("candidates do not depend on the number of threads", "[contact]",
                   BruteForce<DefaultSpace>, SpatialHash<DefaultSpace>, Bvh<DefaultSpace>) {
  for (Kind kind : {Kind::scattered, Kind::all_sizes, Kind::strip}) {
    Soup const soup = make_soup(kind, 1, 300);
    auto const motion = motion_of<Mixed, DefaultSpace>(soup, 0.1);
    auto const results = on_one_thread_and_all([&] { return find<TestType>(soup, motion); });
    CHECK(results[0].edge_edge.size() > 1000);
    CHECK((results[0] == results[1]));
    CHECK((results[0] == find<TestType>(soup, motion)));
  }
}

TEMPLATE_TEST_CASE("a search that is used again finds what a new one does", "[contact]",
                   SpatialHash<DefaultSpace>, Bvh<DefaultSpace>) {
  using S = DefaultSpace;
  Soup soup = make_soup(Kind::scattered, 3, 100);
  PairSearch<TestType> search(copy_surface<S>(soup.surface), soup.edge_length);
  Candidates<S> found;
  Random random(5);
  for (int step = 0; step < 30; ++step) {
    // From a tremble to a shuffle.
    for (Point& v : soup.x) {
      Point const by = in_cube(random, step % 10 == 9 ? 1 : 0.01 * step);
      for (int c = 0; c < 3; ++c) v[c] += by[c];
    }
    auto const motion = motion_of<Fp64, S>(soup, 0);
    search.find(motion, soup.radius, found);
    CHECK((to_host(found) == find<BruteForce<S>>(soup, motion)));
  }
}

TEST_CASE("a hierarchy is sorted anew only when its boxes have grown", "[contact]") {
  using S = DefaultSpace;
  Soup soup = make_soup(Kind::scattered, 3, 200);
  SurfaceBoxes<S> boxes(copy_surface<S>(soup.surface), soup.edge_length);
  Bvh<S> bvh({}, boxes.edges().count, soup.edge_length);
  auto const build = [&] {
    boxes.compute(motion_of<Fp64, S>(soup, 0), soup.radius);
    bvh.build(boxes.edges());
    return bvh.sorts();
  };
  CHECK(build() == 1);
  CHECK(build() == 1);
  for (Point& v : soup.x) v[0] += 10;  // all together
  CHECK(build() == 1);
  Random random(1);
  std::shuffle(soup.x.begin(), soup.x.end(), random);
  CHECK(build() == 2);
}

TEST_CASE("pairs whose vertices are all fixed are left out, and no others", "[contact]") {
  using S = DefaultSpace;
  Soup const soup = make_soup(Kind::strip, 0, 40);
  auto motion = motion_of<Fp64, S>(soup, 0);
  HostCandidates const all = find<SpatialHash<S>>(soup, motion);
  motion.fixed = FixedMask<S>("fixed", soup.x.size());
  CHECK((find<SpatialHash<S>>(soup, motion) == all));  // a mask that fixes none

  std::vector<char> fixed(soup.x.size());
  auto const host = Kokkos::create_mirror_view(motion.fixed);
  for (std::size_t v = 0; v < fixed.size(); ++v) host(v) = fixed[v] = v % 5 != 0;
  assign(motion.fixed, host);
  auto const leave_free = [&](std::vector<std::array<int, 4>> pairs) {
    std::erase_if(pairs, [&](auto const& p) {
      return std::all_of(p.begin(), p.end(), [&](int v) { return fixed[v] != 0; });
    });
    return pairs;
  };
  HostCandidates const expected{leave_free(all.point_triangle), leave_free(all.edge_edge)};
  CHECK(expected.edge_edge.size() < all.edge_edge.size());
  CHECK(expected.point_triangle.size() < all.point_triangle.size());
  CHECK((find<SpatialHash<S>>(soup, motion) == expected));
  CHECK((find<Bvh<S>>(soup, motion) == expected));
}

TEST_CASE("pairs that are held by one mark are left out, and no others", "[contact]") {
  using S = DefaultSpace;
  bool const between_fixed = GENERATE(false, true);
  int const run = GENERATE(3, 40);  // vertices of one mark that follow each other
  CAPTURE(between_fixed, run);
  Soup const soup = make_soup(Kind::strip, 1, 200);
  auto motion = motion_of<Fp64, S>(soup, 0.01);
  HostCandidates const all = find<BruteForce<S>>(soup, motion);
  motion.fixed = FixedMask<S>("fixed", soup.x.size());
  motion.between_fixed = between_fixed;
  std::vector<int> mark(soup.x.size());
  auto const host = Kokkos::create_mirror_view(motion.fixed);
  for (std::size_t v = 0; v < mark.size(); ++v) host(v) = mark[v] = int(v) / run % 4;
  assign(motion.fixed, host);
  auto const leave_free = [&](std::vector<std::array<int, 4>> pairs) {
    std::erase_if(pairs, [&](auto const& p) {
      return std::all_of(p.begin(), p.end(), [&](int v) {
        return mark[v] != 0 && (!between_fixed || mark[v] == mark[p[0]]);
      });
    });
    return pairs;
  };
  HostCandidates const expected{leave_free(all.point_triangle), leave_free(all.edge_edge)};
  CHECK(expected.edge_edge.size() < all.edge_edge.size());
  CHECK((find<BruteForce<S>>(soup, motion) == expected));
  CHECK((find<SpatialHash<S>>(soup, motion) == expected));
  CHECK((find<Bvh<S>>(soup, motion) == expected));
}

TEMPLATE_TEST_CASE("bodies with a floor of two triangles", "[contact]", SpatialHash<DefaultSpace>,
                   Bvh<DefaultSpace>) {
  using S = DefaultSpace;
  TetMesh const ball = make_shape(SphereShape{0.5}, 8);
  auto const n = static_cast<std::int32_t>(ball.points.size());
  Soup soup;
  soup.x = ball.points;
  std::vector<Triangle> triangles = boundary_faces(ball.tets);
  for (Point const& corner :
       {Point{-1e3, -0.51, -1e3}, {1e3, -0.51, -1e3}, {1e3, -0.51, 1e3}, {-1e3, -0.51, 1e3}}) {
    soup.x.push_back(corner);
  }
  triangles.push_back({n, n + 2, n + 1});
  triangles.push_back({n, n + 3, n + 2});
  std::vector<int> object(n, 0);
  object.insert(object.end(), 4, 1);
  soup.surface = make_surface(triangles, object);
  soup.edge_length = 0.1;
  soup.radius = 0.02;
  auto const motion = motion_of<Mixed, S>(soup, 0);
  HostCandidates const found = find<TestType>(soup, motion);
  CHECK((found == find<BruteForce<S>>(soup, motion)));
  CHECK(missing(soup, soup.x, PairSet(found)) == 0);
  CHECK(std::count_if(found.point_triangle.begin(), found.point_triangle.end(),
                      [&](auto const& p) { return p[0] < n && p[1] >= n; }) > 0);
}

TEMPLATE_TEST_CASE("surfaces of next to nothing", "[contact]", BruteForce<DefaultSpace>,
                   SpatialHash<DefaultSpace>, Bvh<DefaultSpace>) {
  using S = DefaultSpace;
  Soup soup;
  soup.edge_length = 1;
  soup.radius = 1;
  soup.surface = make_surface({}, {});
  CHECK((find<TestType>(soup, motion_of<Fp64, S>(soup, 0)) == HostCandidates{}));
  soup.x = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  soup.surface = make_surface({{0, 1, 2}}, {0, 0, 0});
  CHECK((find<TestType>(soup, motion_of<Fp64, S>(soup, 0)) == HostCandidates{}));
  soup.x.push_back({0.2, 0.2, 0.5});
  soup.surface = make_surface({{0, 1, 2}, {0, 1, 3}}, {0, 0, 0, 0});
  HostCandidates const found = find<TestType>(soup, motion_of<Fp64, S>(soup, 0));
  CHECK(found.point_triangle == std::vector<std::array<int, 4>>{{2, 0, 1, 3}, {3, 0, 1, 2}});
  CHECK(found.edge_edge == std::vector<std::array<int, 4>>{{0, 2, 1, 3}, {0, 3, 1, 2}});
  // Edge 0-2 is much longer than 1-3, which asks for it, after 0-3 has.
  soup.x[2] = {0, 100, 0};
  HostCandidates const longer = find<TestType>(soup, motion_of<Fp64, S>(soup, 0));
  CHECK(longer.edge_edge == std::vector<std::array<int, 4>>{{0, 3, 1, 2}, {0, 2, 1, 3}});
}

TEST_CASE("what cannot be searched is refused", "[contact]") {
  using S = DefaultSpace;
  using Search = PairSearch<SpatialHash<S>>;
  Soup soup = make_soup(Kind::scattered, 0);
  auto const surface = copy_surface<S>(soup.surface);
  Candidates<S> found;
  CHECK_THROWS_WITH(Search(surface, 0), ContainsSubstring("edges of 0 m"));
  CHECK_THROWS_WITH(Search(surface, NAN), ContainsSubstring("check the surface"));
  Search search(surface, 1);
  auto const motion = motion_of<Fp64, S>(soup, 0.5);
  CHECK_THROWS_WITH(search.find(motion, -1, found), ContainsSubstring("closer than -1 m"));
  CHECK_THROWS_WITH(search.find(motion, INFINITY, found), ContainsSubstring("ask for a length"));
  auto short_motion = motion;
  short_motion.x = VectorField<double, S>("short", 7);
  CHECK_THROWS_WITH(search.find(short_motion, 1, found), ContainsSubstring("7 positions"));
  soup.x[11][2] = NAN;
  soup.x[17][0] = INFINITY;
  CHECK_THROWS_WITH(search.find(motion_of<Fp64, S>(soup, 0), 1, found),
                    ContainsSubstring("vertex 11 "));
  soup = make_soup(Kind::scattered, 0);
  soup.p[4][1] = INFINITY;
  CHECK_THROWS_WITH(search.find(motion_of<Fp64, S>(soup, 0.5), 1, found),
                    ContainsSubstring("vertex 4 "));
}

namespace {

/// The hashes of the paper's code, for what they are compared with here: int32 that wraps around.
std::uint32_t wrap_abs(std::uint32_t h) { return (h >> 31) != 0 ? 0u - h : h; }
std::uint32_t paper_cell(std::array<int, 3> const& cell, std::uint32_t table) {
  auto const u = [&](int c) { return static_cast<std::uint32_t>(cell[c]); };
  return wrap_abs(u(0) * 92837111u ^ u(1) * 689287499u ^ u(2) * 283923481u) % table;
}
std::uint32_t paper_pair(int a, int b) {
  return wrap_abs(static_cast<std::uint32_t>(a) * 92837111u ^
                  static_cast<std::uint32_t>(b) * 689287499u) %
         (1u << 21);
}

}  // namespace

TEST_CASE("what the paper's hash loses is found here", "[contact][vectors]") {
  auto const reference = test::vectors("hash_reference");
  for (auto const& c : reference["cells"]) {
    CHECK(paper_cell(c["cell"].get<std::array<int, 3>>(), c["table_size"].get<std::uint32_t>()) ==
          c["h"].get<std::uint32_t>());
  }
  for (auto const& p : reference["pairs"]) {
    CHECK(paper_pair(p["a"].get<int>(), p["b"].get<int>()) == p["h"].get<std::uint32_t>());
  }

  // Edges below the plane between two layers of cells and edges above it have no cell in common, so
  // the paper's search for edges sees none of the rods cross.
  using S = DefaultSpace;
  Soup soup = make_soup(Kind::rods, 0);
  for (Point& v : soup.x) v[2] -= 0.5 * soup.radius;
  int crossings = 0;
  HostCandidates const found = find<SpatialHash<S>>(soup, motion_of<Fp64, S>(soup, 0));
  all_pairs(soup.surface, [&](Pair const& pair) {
    if (pair.kind != PairKind::edge_edge || distance(pair, soup.x) >= soup.radius) return;
    double layer[4];
    for (int a = 0; a < 4; ++a) layer[a] = std::floor(soup.x[pair.v[a]][2] / soup.edge_length);
    crossings += layer[0] == layer[1] && layer[2] == layer[3] && layer[0] != layer[2];
  });
  CHECK(crossings == 100);  // ten rods over ten
  CHECK(missing(soup, soup.x, PairSet(found)) == 0);
}
