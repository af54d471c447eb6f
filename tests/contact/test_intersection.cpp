// The whole test on surfaces: its culling against all pairs, bodies inside others, names and
// errors.
#include <taut/contact/box_tree.hpp>
#include <taut/contact/exact_predicates.hpp>
#include <taut/contact/intersection.hpp>
#include <taut/contact/winding_number.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>

using namespace taut;
using Catch::Matchers::MessageMatches;
using Catch::Matchers::StartsWith;

namespace {

using Random = std::mt19937_64;
double unit(Random& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// Bodies put side by side into one mesh.
struct Bodies {
  std::vector<Point> x;
  IntersectionMesh mesh;
  std::int32_t count = 0;

  void add(std::vector<Point> const& points, std::vector<Triangle> const& triangles) {
    auto const first = static_cast<std::int32_t>(x.size());
    x.insert(x.end(), points.begin(), points.end());
    for (auto const& [a, b, c] : triangles)
      mesh.triangles.push_back({a + first, b + first, c + first});
    mesh.body.resize(x.size(), count++);
    mesh.edges = edges_of(mesh.triangles);
  }
  void add(TetMesh const& body, Point const& centre = {}) {
    std::vector<Point> points = body.points;
    for (Point& p : points)
      for (std::size_t c = 0; c < 3; ++c) p[c] += centre[c];
    add(points, boundary_faces(body.tets));
  }
  std::vector<Intersection> find() const { return IntersectionTest(mesh).find(x); }
};

using Key = std::array<std::int32_t, 6>;  // edge, triangle, kind
Key key(Intersection const& i) {
  return {i.edge[0],     i.edge[1],     i.triangle[0],
          i.triangle[1], i.triangle[2], static_cast<std::int32_t>(i.kind)};
}
std::vector<Key> keys(std::vector<Intersection> const& found) {
  std::vector<Key> all;
  for (Intersection const& i : found)
    if (i.kind != IntersectionKind::inside) all.push_back(key(i));
  return all;
}

/// From the definition: every edge against every triangle.
std::vector<Key> all_pairs(Bodies const& bodies) {
  std::vector<Key> all;
  const auto at = [&](std::int32_t v) { return bodies.x[v]; };
  for (Edge const& e : bodies.mesh.edges)
    for (Triangle const& t : bodies.mesh.triangles) {
      if (std::find_first_of(e.begin(), e.end(), t.begin(), t.end()) != e.end()) continue;
      auto const kind = intersect(at(e[0]), at(e[1]), at(t[0]), at(t[1]), at(t[2]));
      if (kind) all.push_back({e[0], e[1], t[0], t[1], t[2], static_cast<std::int32_t>(*kind)});
    }
  return all;
}

std::vector<std::array<std::int32_t, 2>> insides(std::vector<Intersection> const& found) {
  std::vector<std::array<std::int32_t, 2>> pairs;
  for (Intersection const& i : found)
    if (i.kind == IntersectionKind::inside) pairs.push_back({i.edge_body, i.triangle_body});
  return pairs;
}

TetMesh cube(double size, int cells = 2) { return make_shape(BoxShape{{size, size, size}}, cells); }

/// A cube of 3 x 3 x 3 cells without the one in the middle.
TetMesh hollow_cube(double size) {
  TetMesh mesh = cube(size, 3);
  std::erase_if(mesh.tets, [&](Tet const& tet) {
    for (std::size_t c = 0; c < 3; ++c) {
      double middle = 0;
      for (std::int32_t const v : tet) middle += mesh.points[v][c] / 4;
      if (std::abs(middle) > size / 6) return false;
    }
    return true;
  });
  return mesh;
}

/// In the closed tet, whose volume is positive.
bool in_tet(TetMesh const& mesh, Tet const& tet, Point const& q) {
  const auto x = [&](std::size_t k) { return mesh.points[tet[k]]; };
  return orientation(q, x(1), x(2), x(3)) >= 0 && orientation(x(0), q, x(2), x(3)) >= 0 &&
         orientation(x(0), x(1), q, x(3)) >= 0 && orientation(x(0), x(1), x(2), q) >= 0;
}

}  // namespace

TEST_CASE("the search finds the pairs that a look at all pairs finds", "[exact]") {
  Random random(1);
  Bodies bodies;
  bool const on_grid = GENERATE(false, true);
  for (int b = 0; b < 12; ++b) {
    // Tangled strips; on a grid, most corners fall together and many triangles have no area.
    std::vector<Point> points(12);
    for (Point& x : points)
      for (double& c : x) {
        c = 0.2 * b + unit(random);
        if (on_grid) c = std::floor(4 * c);
      }
    std::vector<Triangle> strip;
    for (std::int32_t k = 0; k < 10; ++k) strip.push_back({k, k + 1, k + 2});
    bodies.add(points, strip);
  }
  auto const found = bodies.find();
  auto const expected = all_pairs(bodies);
  REQUIRE(expected.size() > 300);
  CHECK(keys(found) == expected);
  for (Intersection const& i : found) {
    CHECK(i.edge_body == i.edge[0] / 12);
    CHECK(i.triangle_body == i.triangle[0] / 12);
  }
}

TEST_CASE("equal, flat and far-off boxes are searched like others", "[exact]") {
  Random random(2);
  int const shape = GENERATE(0, 1, 2, 3);
  std::vector<Box> boxes;
  for (int k = 0; k < 300; ++k) {
    Point x{unit(random), unit(random), unit(random)}, y = x;
    if (shape == 0) x = y = {1, 2, 3};                         // all the same point
    if (shape == 1) x[0] = y[0] = 0.5;                         // in a plane
    if (shape == 2) y = {x[0] + 0.3, x[1] + 0.1, x[2] + 0.2};  // many overlaps
    if (shape == 3) x = {-1e308 * x[0], -1e308, 0}, y = {1e308, 1e308 * y[1], 1};
    boxes.push_back({x, y});
  }
  BoxTree const tree(boxes);
  std::vector<std::int32_t> found{7};
  for (Box const& box : boxes) {
    tree.find(box, found);
    std::vector<std::int32_t> expected;
    for (std::size_t k = 0; k < boxes.size(); ++k)
      if (boxes[k].overlaps(box)) expected.push_back(static_cast<std::int32_t>(k));
    REQUIRE(found == expected);
  }
  BoxTree({}).find(boxes[0], found);
  CHECK(found.empty());
}

TEST_CASE("surfaces at rest do not intersect themselves", "[exact]") {
  Bodies bodies;
  bodies.add(make_shape(SphereShape{}, 8));
  bodies.add(make_shape(LetterEShape{}, 9), {2, 0, 0});
  bodies.add(hollow_cube(1), {5, 0, 0});
  bodies.add(make_shape(CylinderShape{}, 6), {5, 3, 0});
  CHECK(bodies.find().empty());
  CHECK(IntersectionTest(IntersectionMesh{}).find({}).empty());
}

TEST_CASE("bodies that cross, touch or stand apart by one unit in the last place", "[exact]") {
  double const gap = GENERATE(-0.25, -0x1p-52, 0.0, 0x1p-52);
  Bodies bodies;
  bodies.add(cube(1));
  bodies.add(cube(1), {1 + gap, 0.3, 0.1});
  auto const found = bodies.find();
  CHECK(keys(found) == all_pairs(bodies));
  CHECK(found.empty() == (gap > 0));
  CHECK(insides(found).empty());
  bool const crosses = std::any_of(found.begin(), found.end(), [](Intersection const& i) {
    return i.kind == IntersectionKind::crossing;
  });
  CHECK(crosses == (gap < 0));
  for (Intersection const& i : found) {
    CHECK(i.edge_body != i.triangle_body);
    CHECK(i.place[0] >= 0.5 + gap);
    CHECK(i.place[0] <= 0.5);
  }
}

TEST_CASE("a pair with a common vertex is not asked, one beside it is", "[exact]") {
  Bodies bodies;
  // A fan whose last triangle comes back through the first.
  bodies.add({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {-1, 0, 3}, {1, 1, 1}, {1, 1, -1}},
             {{0, 1, 2}, {0, 2, 3}, {3, 4, 5}});
  auto const found = bodies.find();
  auto const crossing = static_cast<std::int32_t>(IntersectionKind::crossing);
  CHECK(keys(found) == std::vector<Key>{{3, 5, 0, 1, 2, crossing}, {4, 5, 0, 1, 2, crossing}});
  CHECK(found.back().place == Point{1, 1, 0});
}

TEST_CASE("a body wholly inside another is found, and only then", "[exact]") {
  Bodies bodies;
  SECTION("three nested ones") {
    for (double const size : {1.0, 0.5, 0.25}) bodies.add(cube(size));
    CHECK(insides(bodies.find()) ==
          std::vector<std::array<std::int32_t, 2>>{{1, 0}, {2, 0}, {2, 1}});
  }
  SECTION("between the arms of an E, within its box") {
    bodies.add(make_shape(LetterEShape{}, 9));
    bodies.add(cube(0.1), {0.3, 0.2, 0});
    CHECK(bodies.find().empty());
  }
  SECTION("in the hollow of a body, not in the body") {
    bodies.add(hollow_cube(3));
    bodies.add(cube(0.5));
    CHECK(bodies.find().empty());
  }
  SECTION("in the wall of a hollow body") {
    bodies.add(hollow_cube(3));
    bodies.add(cube(0.25), {1.1, 1.1, 0.1});
    CHECK(insides(bodies.find()) == std::vector<std::array<std::int32_t, 2>>{{1, 0}});
  }
  SECTION("a hollow body is inside once, not with both of its surfaces") {
    bodies.add(hollow_cube(3));
    bodies.add(cube(9));
    CHECK(insides(bodies.find()) == std::vector<std::array<std::int32_t, 2>>{{0, 1}});
  }
  SECTION("what touches from within is said to touch") {
    bodies.add(cube(1));
    bodies.add(cube(0.5), {0.25, 0, 0});
    auto const found = bodies.find();
    CHECK_FALSE(found.empty());
    CHECK(insides(found).empty());
  }
  SECTION("one part of a body in two parts") {
    TetMesh two = cube(0.5);
    TetMesh const other = two;
    for (Point x : other.points) two.points.push_back({x[0] + 9, x[1], x[2]});
    for (Tet tet : other.tets) {
      for (std::int32_t& v : tet) v += static_cast<std::int32_t>(other.points.size());
      two.tets.push_back(tet);
    }
    bodies.add(two);
    bodies.add(cube(1), {9, 0, 0});
    CHECK(insides(bodies.find()) == std::vector<std::array<std::int32_t, 2>>{{0, 1}});
  }
  SECTION("an open surface has no inside") {
    TetMesh const outer = cube(1);
    auto faces = boundary_faces(outer.tets);
    CHECK(is_closed(faces));
    faces.pop_back();
    CHECK_FALSE(is_closed(faces));
    bodies.add(outer.points, faces);
    bodies.add(cube(0.5));
    CHECK(bodies.find().empty());
  }
}

TEST_CASE("the winding number tells inside from outside, whatever the ray meets", "[exact]") {
  // From every point of a grid twice as fine as the mesh's: rays along edges, through corners and
  // in faces are the rule.
  TetMesh const mesh = GENERATE(make_shape(LetterEShape{1.125, 0.5}, 9), hollow_cube(3),
                                make_shape(SphereShape{1}, 4));
  auto const surface = boundary_faces(mesh.tets);
  Box box = Box::around(mesh.points);
  double const step = (box.high[1] - box.low[1]) / 18;
  int wrong = 0, inside = 0, outside = 0;
  for (double x = box.low[0] - step; x <= box.high[0] + step; x += step)
    for (double y = box.low[1] - step; y <= box.high[1] + step; y += step)
      for (double z = box.low[2] - step; z <= box.high[2] + step; z += 2 * step) {
        Point const q{x, y, z};
        bool const on = std::any_of(surface.begin(), surface.end(), [&](Triangle const& t) {
          const auto at = [&](std::size_t k) { return mesh.points[t[k]]; };
          return intersect(q, q, at(0), at(1), at(2)).has_value();
        });
        if (on) continue;
        bool const in = std::any_of(mesh.tets.begin(), mesh.tets.end(),
                                    [&](Tet const& tet) { return in_tet(mesh, tet, q); });
        (in ? inside : outside) += 1;
        wrong += winding_number(mesh.points, surface, q) != (in ? 1 : 0);
      }
  CHECK(wrong == 0);
  CHECK(inside > 100);
  CHECK(outside > 100);
}

TEST_CASE("the winding number counts how often, and turns with the surface", "[exact]") {
  TetMesh const ball = make_shape(SphereShape{}, 4);
  auto surface = boundary_faces(ball.tets);
  auto twice = surface;
  twice.insert(twice.end(), surface.begin(), surface.end());
  CHECK(winding_number(ball.points, twice, {0, 0, 0}) == 2);
  for (Triangle& t : surface) std::swap(t[0], t[1]);
  CHECK(is_closed(surface));
  CHECK(winding_number(ball.points, surface, {0, 0, 0}) == -1);
  CHECK(winding_number(ball.points, surface, {0, 0, -5}) == 0);
}

TEST_CASE("an intersection says what, of whom and where", "[exact]") {
  Bodies bodies;
  bodies.add({{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {{0, 1, 2}});
  bodies.add({{1, 1, -1}, {1, 1, 3}, {9, 9, 3}}, {{0, 1, 2}});
  std::vector<std::string> const names{"floor", "ball"};
  auto const found = bodies.find();
  REQUIRE(found.size() == 2);
  CHECK(found[0].text(names) == "edge 1-2 of floor crosses triangle 3-4-5 of ball at (2, 2, 0)");
  CHECK(found[1].text(names) == "edge 3-4 of ball crosses triangle 0-1-2 of floor at (1, 1, 0)");
  CHECK(Intersection{IntersectionKind::inside, {3, 3}, {-1, -1, -1}, 1, 0, {0.5, 0, 2}}.text(
            names) == "ball is inside floor: its vertex 3 at (0.5, 0, 2)");
  CHECK(Intersection{IntersectionKind::touching, {3, 4}, {5, 6, 7}, 1, 1, {}}.text(names) ==
        "edge 3-4 of ball touches triangle 5-6-7 of the same at (0, 0, 0)");
}

TEST_CASE("the place of an intersection lies on both, near as rounding allows", "[exact]") {
  Bodies bodies;
  bodies.add(make_shape(SphereShape{}, 6));
  bodies.add(make_shape(SphereShape{}, 6), {0.3, 0.2, 0.1});
  auto const found = bodies.find();
  REQUIRE(found.size() > 50);
  for (Intersection const& i : found) {
    if (i.kind != IntersectionKind::crossing) continue;
    Point const a = bodies.x[i.edge[0]], b = bodies.x[i.edge[1]];
    double direct = 0, around = 0;
    for (std::size_t c = 0; c < 3; ++c) direct += (a[c] - b[c]) * (a[c] - b[c]);
    double first = 0, second = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      first += (a[c] - i.place[c]) * (a[c] - i.place[c]);
      second += (b[c] - i.place[c]) * (b[c] - i.place[c]);
    }
    around = std::sqrt(first) + std::sqrt(second);
    CHECK(around <= std::sqrt(direct) * (1 + 1e-12));
  }
}

TEST_CASE("the test refuses what it cannot judge", "[exact]") {
  IntersectionMesh const mesh{{{0, 1, 2}}, {{0, 1}, {1, 2}, {0, 2}}, {0, 0, 0, 0}};
  IntersectionTest const test(mesh);
  std::vector<Point> x{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}};
  x[3][1] = std::numeric_limits<double>::quiet_NaN();
  CHECK(test.find(x).empty());  // of no edge or triangle
  x[2][1] = std::numeric_limits<double>::infinity();
  CHECK_THROWS_MATCHES(test.find(x), Error,
                       MessageMatches(StartsWith("intersection test: the position of vertex 2")));
  x.pop_back();
  CHECK_THROWS_AS(test.find(x), Error);
  IntersectionMesh two = mesh;
  two.body[2] = 1;
  CHECK_THROWS_AS(IntersectionTest(two), Error);
  IntersectionMesh missing = mesh;
  missing.edges.push_back({1, 4});
  CHECK_THROWS_AS(IntersectionTest(missing), Error);
}
