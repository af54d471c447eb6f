// Procedural meshes: valid (positive, conforming, closed manifold boundary of the right genus),
// exact where the shape is a union of boxes, second order in volume where it is round, symmetric,
// and with tets whose shape does not degrade under refinement.

#include <taut/core/fem/shapes.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <array>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <utility>

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

Point minus(Point const& a, Point const& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point cross(Point const& a, Point const& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(Point const& a, Point const& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

std::array<Point, 4> corners(TetMesh const& mesh, Tet const& tet) {
  std::array<Point, 4> x{};
  for (std::size_t a = 0; a < 4; ++a) x[a] = mesh.points[static_cast<std::size_t>(tet[a])];
  return x;
}

double volume(std::array<Point, 4> const& x) {
  return dot(minus(x[1], x[0]), cross(minus(x[2], x[0]), minus(x[3], x[0]))) / 6;
}

double volume(TetMesh const& mesh) {
  double sum = 0;
  for (Tet const& tet : mesh.tets) sum += volume(corners(mesh, tet));
  return sum;
}

/// Smallest dihedral angle in degrees: pi minus the angle between the outward normals.
double smallest_angle(TetMesh const& mesh) {
  double largest_cosine = -1;
  for (Tet const& tet : mesh.tets) {
    auto const x = corners(mesh, tet);
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = a + 1; b < 4; ++b) {
        std::size_t const c = a == 0 ? (b == 1 ? 2 : 1) : 0, d = 6 - a - b - c;
        Point const edge = minus(x[b], x[a]);
        Point const m = cross(edge, minus(x[c], x[a])), n = cross(edge, minus(x[d], x[a]));
        largest_cosine = std::max(largest_cosine, dot(m, n) / std::sqrt(dot(m, m) * dot(n, n)));
      }
  }
  return std::acos(largest_cosine) * 180 / std::numbers::pi;
}

/// Euler characteristic of the boundary; requires it to be a closed, oriented manifold.
int boundary_characteristic(TetMesh const& mesh) {
  std::set<std::pair<std::int32_t, std::int32_t>> edges;
  std::map<std::int32_t, std::map<std::int32_t, std::int32_t>> links;
  auto const faces = boundary_faces(mesh.tets);
  for (Triangle const& face : faces)
    for (std::size_t a = 0; a < 3; ++a) {
      std::int32_t const v = face[a], next = face[(a + 1) % 3], last = face[(a + 2) % 3];
      REQUIRE(edges.emplace(v, next).second);
      links[v].emplace(next, last);
    }
  for (auto const& [a, b] : edges) REQUIRE(edges.count({b, a}) == 1);
  for (auto const& [v, link] : links) {  // one closed fan of faces around every vertex
    std::size_t steps = 0;
    std::int32_t const first = link.begin()->first;
    std::int32_t at = first;
    do {
      at = link.at(at);
      ++steps;
    } while (at != first && steps <= link.size());
    REQUIRE(steps == link.size());
  }
  return static_cast<int>(links.size()) - static_cast<int>(edges.size()) / 2 +
         static_cast<int>(faces.size());
}

void require_valid(TetMesh const& mesh) {
  std::vector<bool> used(mesh.points.size(), false);
  std::map<Triangle, int> faces;
  for (Tet const& tet : mesh.tets) {
    REQUIRE(volume(corners(mesh, tet)) > 0);
    for (std::size_t a = 0; a < 4; ++a) {
      used.at(static_cast<std::size_t>(tet[a])) = true;
      Triangle face{tet[(a + 1) % 4], tet[(a + 2) % 4], tet[(a + 3) % 4]};
      std::sort(face.begin(), face.end());
      REQUIRE(++faces[face] <= 2);
    }
  }
  REQUIRE(std::count(used.begin(), used.end(), false) == 0);
}

/// The points and the tets of a mesh after a motion of space, in an order of their own.
using Rounded = std::array<long long, 3>;
std::set<std::set<Rounded>> tet_set(TetMesh const& mesh, std::array<std::size_t, 3> const& axes,
                                    Point const& sign) {
  std::set<std::set<Rounded>> all;
  for (Tet const& tet : mesh.tets) {
    std::set<Rounded> points;
    for (Point const& x : corners(mesh, tet)) {
      Rounded r{};
      for (std::size_t a = 0; a < 3; ++a) r[a] = std::llround(sign[a] * x[axes[a]] * 1e9);
      points.insert(r);
    }
    all.insert(points);
  }
  return all;
}

void require_mirror_symmetric(TetMesh const& mesh, std::array<bool, 3> const& axes) {
  auto const own = tet_set(mesh, {0, 1, 2}, {1, 1, 1});
  for (std::size_t a = 0; a < 3; ++a) {
    if (!axes[a]) continue;
    Point sign{1, 1, 1};
    sign[a] = -1;
    REQUIRE(tet_set(mesh, {0, 1, 2}, sign) == own);
  }
}

struct Case {
  std::string name;
  Shape shape;
  int resolution;
  int characteristic;
};

BoxUnionShape const ring{{{{{0, 0, 0}, {3, 1, 1}}},
                          {{{0, 2, 0}, {3, 3, 1}}},
                          {{{0, 0, 0}, {1, 3, 1}}},
                          {{{2, 0, 0}, {3, 3, 1}}}}};

/// A pyramid on a square; the second tet names its vertices in another order than the first.
TetMesh const two_tets{{{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}, {0.5, 3, 0.5}},
                       {{0, 2, 1, 4}, {3, 2, 0, 4}}};

/// By the divergence theorem: positive if the surface is oriented outward.
double volume(TriangleMesh const& surface) {
  double sum = 0;
  for (auto const& [a, b, c] : surface.triangles)
    sum += dot(surface.points.at(static_cast<std::size_t>(a)),
               cross(surface.points.at(static_cast<std::size_t>(b)),
                     surface.points.at(static_cast<std::size_t>(c)))) /
           6;
  return sum;
}

}  // namespace

TEST_CASE("every shape is a valid mesh with a closed manifold boundary of its genus") {
  auto const [name, shape, resolution, characteristic] = GENERATE(
      Case{"one cell", BoxShape{}, 1, 2}, Case{"box", BoxShape{{1, 0.4, 2}}, 7, 2},
      Case{"sheet", BoxShape{{1, 0.01, 1}}, 8, 2},
      Case{"letter E", LetterEShape{1.125, 0.3}, 18, 2}, Case{"ring of boxes", ring, 6, 0},
      Case{"cylinder", CylinderShape{}, 6, 2},
      Case{"coarsest cylinder", CylinderShape{0.5, 1, 2}, 1, 2},
      Case{"rod", CylinderShape{0.02, 1, 0}, 3, 2}, Case{"coarsest sphere", SphereShape{}, 1, 2},
      Case{"sphere", SphereShape{}, 7, 2}, Case{"coarsest torus", TorusShape{0.5, 0.49}, 1, 0},
      Case{"torus", TorusShape{}, 5, 0}, Case{"coarsest bowl", BowlShape{}, 1, 2},
      Case{"bowl", BowlShape{}, 12, 2},
      Case{"thick, nearly closed bowl", BowlShape{1, 0.4, 1.8}, 9, 2},
      Case{"coarsest funnel", FunnelShape{}, 1, 0}, Case{"funnel", FunnelShape{}, 9, 0},
      Case{"flat funnel", FunnelShape{1, 0.1, 0.05, 0.3, 0.2}, 8, 0},
      Case{"tets", TetsShape{two_tets}, 1, 2}, Case{"finer tets", TetsShape{two_tets}, 4, 2});
  INFO(name);
  TetMesh const mesh = make_shape(shape, resolution);
  require_valid(mesh);
  CHECK(boundary_characteristic(mesh) == characteristic);

  // Its surface alone: the boundary's triangles, oriented outward, with no vertex beside them.
  TriangleMesh const surface = boundary_surface(mesh);
  CHECK(surface.triangles.size() == boundary_faces(mesh.tets).size());
  CHECK_THAT(volume(surface), WithinRel(volume(mesh), 1e-12));
  std::set<std::int32_t> used;
  for (Triangle const& triangle : surface.triangles) used.insert(triangle.begin(), triangle.end());
  CHECK(used.size() == surface.points.size());
}

TEST_CASE("a cube of 20 cells is the paper's cube_40: 19661 vertices, 100800 tets") {
  TetMesh const mesh = make_shape(BoxShape{{0.5, 0.5, 0.5}}, 20);
  CHECK(mesh.points.size() == 19661);
  CHECK(mesh.tets.size() == 100800);
}

TEST_CASE("boxes and their unions have their exact volume and extent") {
  CHECK_THAT(volume(make_shape(BoxShape{{2, 0.3, 0.7}}, 5)), WithinRel(0.42, 1e-13));
  CHECK_THAT(volume(make_shape(ring, 3)), WithinRel(8.0, 1e-13));
  // Spine 0.25 x 1.125 and three arms 0.75 x 0.125, one deep.
  TetMesh const letter = make_shape(LetterEShape{}, 9);
  CHECK_THAT(volume(letter), WithinRel(0.25 * 1.125 + 3 * 0.75 * 0.125, 1e-13));
  Point low = letter.points[0], high = low;
  for (Point const& x : letter.points)
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], x[a]);
      high[a] = std::max(high[a], x[a]);
    }
  CHECK(low == Point{-0.5, -0.5625, -0.5});
  CHECK(high == Point{0.5, 0.5625, 0.5});
  // A union keeps the coordinates it is given.
  CHECK(make_shape(BoxUnionShape{{{{{1, 2, 3}, {2, 3, 4}}}}}, 1).points.front() == Point{1, 2, 3});
}

TEST_CASE("round shapes approach their volume at second order, from inside") {
  double const pi = std::numbers::pi;
  auto const [name, shape, exact] = GENERATE_COPY(
      std::tuple<std::string, Shape, double>{"sphere", SphereShape{0.7}, 4 * pi * 0.343 / 3},
      std::tuple<std::string, Shape, double>{"cylinder", CylinderShape{0.5, 1, 1}, pi / 4},
      std::tuple<std::string, Shape, double>{"torus", TorusShape{0.5, 0.2},
                                             2 * pi * pi * 0.5 * 0.04},
      std::tuple<std::string, Shape, double>{"hemispherical bowl", BowlShape{0.5, 0.1, 0.5},
                                             2 * pi / 3 * (0.216 - 0.125)},
      std::tuple<std::string, Shape, double>{"shallow bowl", BowlShape{0.5, 0.1, 0.25},
                                             2 * pi / 3 * 0.5 * (0.216 - 0.125)});
  INFO(name);
  double const coarse = exact - volume(make_shape(shape, 8));
  double const fine = exact - volume(make_shape(shape, 16));
  CHECK(fine > 0);
  CHECK(fine < 0.01 * exact);
  CHECK_THAT(std::log2(coarse / fine), WithinAbs(2.0, 0.05));
}

TEST_CASE("a bowl lies between its two balls, below its rim") {
  double const height = GENERATE(0.1, 0.5, 0.9);
  TetMesh const mesh = make_shape(BowlShape{0.5, 0.1, height}, 7);
  double top = -1, least = 1, most = 0;
  for (Point const& x : mesh.points) {
    double const distance = std::sqrt(dot(x, x));
    least = std::min(least, distance);
    most = std::max(most, distance);
    top = std::max(top, x[1] / distance);
  }
  CHECK_THAT(least, WithinAbs(0.5, 1e-12));
  CHECK_THAT(most, WithinAbs(0.6, 1e-12));
  CHECK_THAT(0.5 * top, WithinAbs(height - 0.5, 1e-12));
}

TEST_CASE("a funnel's wall is as thick as asked and turns around its axis") {
  FunnelShape const funnel{0.5, 0.15, 0.4, 0.2, 0.05};
  auto const wall = [&](int resolution) { return volume(make_shape(funnel, resolution)); };
  // Pappus: the cross-section, cut into triangles, times the ways of their centroids.
  double const slant = std::hypot(0.35, 0.4), mitre = 0.05 * 0.35 / (slant + 0.4);
  std::array<std::array<double, 2>, 6> const ring{
      {{0.15, -0.2},
       {0.2, -0.2},
       {0.2, -mitre},
       {0.5 + 0.05 * 0.4 / slant, 0.4 - 0.05 * 0.35 / slant},
       {0.5, 0.4},
       {0.15, 0}}};
  double exact = 0;
  for (std::size_t k = 0; k < 6; ++k) {
    auto const &a = ring[k], &b = ring[(k + 1) % 6];
    exact += std::numbers::pi / 3 * (a[0] * b[1] - b[0] * a[1]) * (a[0] + b[0]);
  }
  double const coarse = exact - wall(16), fine = exact - wall(32);
  CHECK(fine > 0);
  CHECK(fine < 0.01 * exact);
  CHECK_THAT(std::log2(coarse / fine), WithinAbs(2.0, 0.15));

  // Both walls of the cone are the mitre's distance apart, and the tube is open.
  for (Point const& x : make_shape(funnel, 8).points) {
    double const r = std::hypot(x[0], x[2]);
    double const from_cone = ((r - 0.15) * 0.4 - x[1] * 0.35) / slant;
    CHECK(r > 0.1499);
    if (x[1] > 0) {
      CHECK(from_cone > -1e-12);
      CHECK(from_cone < 0.05 + 1e-12);
    }
  }
}

TEST_CASE("tets keep their shape under refinement") {
  CHECK_THAT(smallest_angle(make_shape(BoxShape{}, 4)), WithinAbs(45.0, 1e-9));
  CHECK_THAT(smallest_angle(make_shape(LetterEShape{}, 9)), WithinAbs(45.0, 1e-9));
  int const resolution = GENERATE(1, 2, 3, 4, 9, 16);
  INFO("resolution " << resolution);
  CHECK(smallest_angle(make_shape(SphereShape{}, resolution)) > 26);
  CHECK(smallest_angle(make_shape(CylinderShape{}, resolution)) > 33);
  CHECK(smallest_angle(make_shape(TorusShape{}, resolution)) > 24);
  for (auto const& [thickness, angle] : {std::pair{0.3, 8.0}, {0.1, 7.0}, {0.02, 3.0}}) {
    INFO("thickness " << thickness);
    CHECK(smallest_angle(make_shape(BowlShape{0.5, thickness, 0.5}, resolution)) > angle);
    CHECK(smallest_angle(make_shape(FunnelShape{0.5, 0.15, 0.5, 0.4, thickness}, resolution)) >
          angle);
  }
}

TEST_CASE("meshes have the symmetries of their shapes") {
  int const resolution = GENERATE(4, 5);
  for (Shape const& shape : {Shape{BoxShape{}}, Shape{BoxShape{{1, 0.5, 2}}},
                             Shape{CylinderShape{}}, Shape{SphereShape{}}})
    require_mirror_symmetric(make_shape(shape, resolution), {true, true, true});
  require_mirror_symmetric(make_shape(LetterEShape{}, 9), {false, true, true});
  require_mirror_symmetric(make_shape(TorusShape{}, resolution), {false, true, true});
  for (Shape const& shape : {Shape{BoxShape{}}, Shape{SphereShape{}}}) {
    TetMesh const mesh = make_shape(shape, resolution);
    CHECK(tet_set(mesh, {1, 2, 0}, {1, 1, 1}) == tet_set(mesh, {0, 1, 2}, {1, 1, 1}));
    CHECK(tet_set(mesh, {1, 0, 2}, {1, 1, 1}) == tet_set(mesh, {0, 1, 2}, {1, 1, 1}));
  }
}

TEST_CASE("cylinders stand along the axis asked for") {
  int const axis = GENERATE(0, 1, 2);
  TetMesh const mesh = make_shape(CylinderShape{0.1, 2, axis}, 2);
  for (std::size_t a = 0; a < 3; ++a) {
    double reach = 0;
    for (Point const& x : mesh.points) reach = std::max(reach, x[a]);
    CHECK_THAT(reach, WithinAbs(static_cast<int>(a) == axis ? 1.0 : 0.1, 1e-12));
  }
}

TEST_CASE("shapes that cannot be meshed are refused with a sentence") {
  auto const refused = [](Shape const& shape, int resolution, std::string const& part) {
    CHECK_THROWS_MATCHES(make_shape(shape, resolution), Error,
                         MessageMatches(ContainsSubstring(part)));
  };
  refused(BoxShape{}, 0, "at least 1");
  refused(BoxShape{{1, -1, 1}}, 4, "positive");
  refused(BoxShape{{1, 1, std::nan("")}}, 4, "positive");
  refused(BoxShape{}, 2000000000, "lower its resolution");
  refused(BoxUnionShape{}, 4, "at least one");
  refused(ring, 4, "multiple of 3");
  refused(BoxUnionShape{{{{{0, 0, 0}, {1, std::sqrt(2.0), 1}}}}}, 4, "no common lattice");
  refused(BoxUnionShape{{{{{0, 0, 0}, {1, 1, 1}}}, {{{1, 1, 0}, {2, 2, 1}}}}}, 2, "share a face");
  refused(BoxUnionShape{{{{{0, 0, 0}, {1, 1, 1}}}, {{{1, 1, 1}, {2, 2, 2}}}}}, 4, "share a face");
  refused(LetterEShape{}, 10, "multiple of 9");
  refused(CylinderShape{0.5, 1, 3}, 4, "0, 1 or 2");
  refused(SphereShape{0}, 4, "radius");
  refused(TorusShape{0.2, 0.2}, 4, "smaller");
  refused(BowlShape{0.5, 0, 0.5}, 4, "thickness");
  refused(BowlShape{0.5, 0.1, 0.95}, 4, "closed above 1.8 radii");
  refused(FunnelShape{0.5, 0.5, 0.5, 0.2, 0.05}, 4, "throat must be the smaller");
  refused(FunnelShape{0.5, 0.2, 0.5, 0.05, 0.05}, 4, "spout must be the longer");
  refused(FunnelShape{0.5, 0.2, 0.5, 0.2, 0.05}, 100000, "lower its resolution");
  refused(TetsShape{{{{0, 0, 0}}, {{0, 0, 0, 1}}}}, 1, "names vertex 1, but there are 1");
  refused(TetsShape{two_tets}, 1000, "lower its resolution");
  refused(TetsShape{two_tets}, 0, "at least 1");
}

TEST_CASE("a shape says what its resolution is a multiple of") {
  CHECK(resolution_unit(BoxShape{}) == 1);
  CHECK(resolution_unit(LetterEShape{}) == 9);
  CHECK(resolution_unit(ring) == 3);
  CHECK(resolution_unit(BoxUnionShape{{{{{0, 0, 0}, {1, std::sqrt(2.0), 1}}}}}) == 1);
  CHECK(resolution_unit(BoxUnionShape{}) == 1);
  CHECK(resolution_unit(TetsShape{two_tets}) == 1);
}
