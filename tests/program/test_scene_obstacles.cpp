// Obstacles from text to surfaces: closed, oriented outward, placed; their pictures; their
// mistakes.

#include <taut/apps/program/run_identity.hpp>
#include <taut/apps/program/scene_geometry.hpp>
#include <taut/apps/program/scene_obstacle.hpp>
#include <taut/contact/surface.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#include <cmath>
#include <numbers>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using test::plain_scene;
using test::ScratchFolder;

namespace {

std::string with(std::string const& obstacle) {
  return plain_scene + "\n[[obstacle]]\nname = \"thing\"\n" + obstacle + "\n";
}

Scene load(std::string const& obstacle) {
  ScratchFolder const folder;
  return load_scene(folder.write("scene.toml", with(obstacle)));
}

TriangleMesh surface_of(std::string const& obstacle) {
  SceneGeometry const geometry = build_geometry(load(obstacle));
  REQUIRE(geometry.obstacle_meshes.size() == 1);
  CHECK(geometry.obstacle_meshes[0].obstacle == 0);
  CHECK_FALSE(geometry.obstacle_meshes[0].drawn_only);
  return geometry.obstacle_meshes[0].mesh;
}

double volume(TriangleMesh const& mesh) {
  double sum = 0;
  for (auto const& [a, b, c] : mesh.triangles)
    sum += dot(mesh.points.at(static_cast<std::size_t>(a)),
               cross(mesh.points.at(static_cast<std::size_t>(b)),
                     mesh.points.at(static_cast<std::size_t>(c)))) /
           6;
  return sum;
}

bool is_closed(TriangleMesh const& mesh) {
  std::vector<int> const one(mesh.points.size(), 0);
  SurfaceReport const report = check_surface(make_surface(mesh.triangles, one), "surface");
  return report.open.empty() && report.crowded.empty() && report.twisted.empty() &&
         report.repeated.empty();
}

std::array<Point, 2> box_of(TriangleMesh const& mesh) {
  std::array<Point, 2> box{mesh.points.at(0), mesh.points.at(0)};
  for (Point const& x : mesh.points)
    for (std::size_t a = 0; a < 3; ++a) {
      box[0][a] = std::min(box[0][a], x[a]);
      box[1][a] = std::max(box[1][a], x[a]);
    }
  return box;
}

/// The normal of the triangle, times twice its area.
Point normal_of(TriangleMesh const& mesh, Triangle const& triangle) {
  auto const at = [&](std::size_t a) { return mesh.points[static_cast<std::size_t>(triangle[a])]; };
  return cross(at(1) - at(0), at(2) - at(0));
}

void refused(std::string const& obstacle, std::string const& sentence) {
  CHECK_THROWS_MATCHES(build_geometry(load(obstacle)), Error,
                       MessageMatches(ContainsSubstring(sentence)));
}

std::array<Point, 2> const unit_box{{{0, 0, 0}, {1, 1, 1}}};

}  // namespace

TEST_CASE("the outside of a shape is a closed surface, oriented outward, of the shape's volume") {
  double const pi = std::numbers::pi;
  auto const [shape, exact] = GENERATE_COPY(
      std::pair<std::string, double>{"kind = 'box', size = [1, 2, 3]", 6},
      std::pair<std::string, double>{"kind = 'box', size = [1, 2, 3], inside = false", 6},
      std::pair<std::string, double>{"kind = 'sphere', radius = 0.5", pi / 6},
      std::pair<std::string, double>{"kind = 'cylinder', radius = 0.5, height = 2", pi / 2},
      std::pair<std::string, double>{"kind = 'torus', radius = 1, tube_radius = 0.25", pi * pi / 8},
      std::pair<std::string, double>{"kind = 'bowl', radius = 1, thickness = 0.2, height = 1",
                                     2 * pi / 3 * (1.728 - 1)},
      // Pappus, as in tests/core/fem/test_shapes.cpp.
      std::pair<std::string, double>{
          "kind = 'funnel', radius = 0.5, throat = 0.2, height = 0.4, spout = 0.3, thickness = 0.1",
          0.1641308});
  INFO(shape);
  TriangleMesh const mesh = surface_of("shape = { " + shape + ", resolution = 24 }");
  CHECK(is_closed(mesh));
  CHECK_THAT(volume(mesh), WithinRel(exact, 0.01));
}

TEST_CASE("a surface is scaled, then rotated, then translated, and stays oriented outward") {
  TriangleMesh const mesh = surface_of(
      "shape = { kind = 'box', size = [1, 2, 3], resolution = 3 }\nscale = 2\n"
      "rotate = { axis = [0, 0, 1], angle = 90 }\ntranslate = [10, 20, 30]");
  auto const [low, high] = box_of(mesh);
  for (std::size_t a = 0; a < 3; ++a) {
    CHECK_THAT(low[a], WithinAbs((Point{8, 19, 27})[a], 1e-12));
    CHECK_THAT(high[a], WithinAbs((Point{12, 21, 33})[a], 1e-12));
  }
  CHECK_THAT(volume(mesh), WithinRel(48.0, 1e-12));
}

TEST_CASE("what keeps bodies inside, and half of space, keep their numbers and are drawn only") {
  Scene const scene =
      load(R"(shape = { kind = "half_space", point = [0, -2, 0], normal = [0, 2, 0] }
friction = 0.5
scale = 3

[[obstacle]]
name = "room"
shape = { kind = "box", inside = true, size = [1, 2, 3] }
scale = 2
translate = [5, 0, 0]

[[obstacle]]
name = "bubble"
shape = { kind = "sphere", inside = true, radius = 2 }

[[obstacle.motion]]
end = 2
velocity = [0, 1, 0]

[[obstacle.motion]]
start = 3
axis = [0, 1, 0]
centre = [1, 0, 0]
angular_velocity = 90

[[obstacle]]
name = "drum"
shape = { kind = "cylinder", inside = true, radius = 2, height = 1 }
rotate = { axis = [0, 0, 1], angle = 90 })");
  REQUIRE(scene.obstacles.size() == 4);
  SceneGeometry const geometry = build_geometry(scene);
  REQUIRE(geometry.obstacle_meshes.size() == 4);
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(geometry.obstacle_meshes[i].obstacle == i);
    CHECK(geometry.obstacle_meshes[i].drawn_only);
    CHECK_FALSE(geometry.obstacle_meshes[i].mesh.triangles.empty());
  }
  // A patch of the plane under the bodies; the wall of the room, at time 0.
  for (Point const& x : geometry.obstacle_meshes[0].mesh.points) CHECK(x[1] == -6);
  auto const [low, high] = box_of(geometry.obstacle_meshes[1].mesh);
  CHECK(low == Point{4, -2, -3});
  CHECK(high == Point{6, 2, 3});
  SceneObstacle const& floor = scene.obstacles[0];
  CHECK(floor.name == "thing");
  CHECK_THAT(floor.where, ContainsSubstring("scene.toml:17: obstacle.thing"));
  CHECK(std::get<HalfSpaceShape>(floor.geometry).point == Point{0, -6, 0});
  CHECK(std::get<HalfSpaceShape>(floor.geometry).normal == Point{0, 1, 0});
  CHECK(floor.friction == 0.5);
  CHECK_FALSE(floor.is_surface());
  SceneObstacle const& room = scene.obstacles[1];
  CHECK(std::get<InsideBoxShape>(room.geometry).size == Point{2, 4, 6});
  CHECK(room.placement({1, 0, 0}) == Point{6, 0, 0});
  CHECK_FALSE(room.friction.has_value());
  SceneObstacle const& bubble = scene.obstacles[2];
  CHECK(std::get<InsideSphereShape>(bubble.geometry).radius == 2);
  Point const moved = bubble.motion.at(4)({2, 0, 0});  // up by 2, then a quarter turn
  CHECK_THAT(norm(moved - Point{1, 2, -1}), WithinAbs(0, 1e-12));
  CHECK(std::get<InsideCylinderShape>(scene.obstacles[3].geometry).height == 1);
  CHECK_THAT(norm(scene.obstacles[3].placement({0, 1, 0}) - Point{-1, 0, 0}), WithinAbs(0, 1e-12));
}

TEST_CASE("a surface from a file: closed ones are turned outward, open ones warned of") {
  ScratchFolder const folder;
  TriangleMesh cube = boundary_surface(make_shape(BoxShape{}, 1));
  cube.points.push_back({9, 9, 9});  // no triangle names it
  auto const read = [&](TriangleMesh const& mesh, std::vector<std::string>& warnings) {
    write_obj(folder.write("thing.obj", ""), mesh);
    SceneGeometry geometry =
        build_geometry(load_scene(folder.write("scene.toml", with("mesh = \"thing.obj\""))));
    warnings = geometry.warnings;
    return geometry.obstacle_meshes.at(0).mesh;
  };
  std::vector<std::string> warnings;
  CHECK_THAT(volume(read(cube, warnings)), WithinRel(1.0, 1e-13));
  CHECK(warnings.empty());
  CHECK(read(cube, warnings).points.size() == cube.points.size() - 1);

  TriangleMesh inward = cube;
  for (Triangle& triangle : inward.triangles) std::swap(triangle[0], triangle[1]);
  CHECK_THAT(volume(read(inward, warnings)), WithinRel(1.0, 1e-13));
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], ContainsSubstring("oriented inward and have been turned round"));

  // A small one far away: what its orientation is told by must not drown in the distance.
  for (double const away : {-2e3 / 3, 1e4 / 7, -3e4 / 7}) {
    CAPTURE(away);
    TriangleMesh outward = cube;
    for (Point& x : outward.points) x = 1e-3 * x + Point{away, 0.7 * away, -0.3 * away};
    CHECK(read(outward, warnings).triangles == outward.triangles);
    CHECK(warnings.empty());
  }

  TriangleMesh open = cube;
  open.triangles.pop_back();
  CHECK(read(open, warnings).triangles.size() == open.triangles.size());
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], ContainsSubstring("thing.obj") && ContainsSubstring("open"));

  TriangleMesh flat = cube;
  flat.points[static_cast<std::size_t>(flat.triangles[3][0])] =
      flat.points[static_cast<std::size_t>(flat.triangles[3][1])];
  CHECK_THROWS_MATCHES(read(flat, warnings), Error,
                       MessageMatches(ContainsSubstring("thing.obj: triangle") &&
                                      ContainsSubstring("has no area: remove it")));
  CHECK_THROWS_MATCHES(read({cube.points, {}}, warnings), Error,
                       MessageMatches(ContainsSubstring("thing.obj")));
}

TEST_CASE("every obstacle can be drawn: planes as a patch under the bodies, insides as walls") {
  auto const draw = [](std::string const& text) {
    return triangles_of(load(text).obstacles.at(0), {{{-1, 3, -2}, {1, 5, 2}}}, 8);
  };
  TriangleMesh const patch = draw(
      "shape = { kind = 'half_space', point = [7, -1, 0], normal = [0, 3, 4] }\n"
      "translate = [0, 0, 2]");
  CHECK(patch.triangles.size() == 2 * 8 * 8);
  double area = 0;
  Point middle{};
  for (Point const& x : patch.points) {
    CHECK_THAT(0.6 * (x[1] + 1) + 0.8 * (x[2] - 2), WithinAbs(0, 1e-12));
    middle = middle + (1.0 / 81) * x;
  }
  for (Triangle const& t : patch.triangles) {
    Point const n = normal_of(patch, t);
    CHECK(0.6 * n[1] + 0.8 * n[2] > 0);
    area += norm(n) / 2;
  }
  CHECK_THAT(area, WithinRel(4.0 * (4 + 4 + 16), 1e-12));
  // The foot of the bodies' centre (0, 4, 0): 0.6 * 5 - 0.8 * 2 = 1.4 above the plane.
  CHECK_THAT(norm(middle - Point{0, 4 - 1.4 * 0.6, -1.4 * 0.8}), WithinAbs(0, 1e-12));

  for (auto const& [text, size] :
       {std::pair<std::string, double>{"kind = 'box', inside = true, size = [2, 2, 2]", 8},
        {"kind = 'sphere', inside = true, radius = 1", 4 * std::numbers::pi / 3},
        {"kind = 'cylinder', inside = true, radius = 1, height = 2", 2 * std::numbers::pi}}) {
    INFO(text);
    TriangleMesh const wall = draw("shape = { " + text + " }\ntranslate = [1, 2, 3]");
    CHECK(is_closed(wall));
    CHECK_THAT(volume(wall), WithinRel(-size, 0.06));  // its front is the side of the bodies
    auto const [low, high] = box_of(wall);
    CHECK_THAT(norm(0.5 * (low + high) - Point{1, 2, 3}), WithinAbs(0, 1e-9));
  }
  TriangleMesh const bowl =
      draw("shape = { kind = 'bowl', radius = 1, thickness = 0.2, height = 1, resolution = 4 }");
  CHECK(volume(bowl) > 0);
}

TEST_CASE("mistakes in obstacles are answered with where, what and the mend") {
  refused("", "scene.toml:17: obstacle.thing has no geometry: give either a shape or a mesh");
  refused("shape = { kind = 'half_space' }\nmesh = 'a.obj'", "has both a shape and a mesh");
  refused("shape = { kind = 'half_spice' }",
          "scene.toml:19: obstacle.thing.shape.kind is 'half_spice', nearest is 'half_space'");
  refused("shape = { kind = 'half_space', norml = [0, 1, 0] }", "the nearest is 'normal'");
  refused("shape = { kind = 'half_space', normal = [0, 0, 0] }", "has length 0: give a direction");
  refused("shape = { kind = 'torus', inside = true, radius = 1, tube_radius = 0.1 }",
          "kind is 'torus': choose one of box, sphere, cylinder");
  refused("shape = { kind = 'sphere', inside = true, radius = 1, resolution = 3 }",
          "obstacle.thing.shape has no resolution: with inside = true it is no mesh");
  refused("shape = { kind = 'sphere', inside = 1, radius = 1 }", "inside is a whole number: it");
  refused("shape = { kind = 'box', inside = true, size = [1, 0, 1] }", "has an edge of 0 m");
  refused("shape = { kind = 'sphere', radius = 1 }",
          "obstacle.thing.shape lacks the key 'resolution'");
  refused("shape = { kind = 3 }", "obstacle.thing.shape.kind is a whole number: it must be text");
  refused("shape = { inside = true }", "obstacle.thing.shape lacks the key 'kind'");
  refused("shape = { kind = 'letter_e', resolution = 10 }",
          "obstacle.thing.shape: the letter E has resolution 10");
  refused("shape = { kind = 'half_space' }\nfriction = -0.1",
          "scene.toml:20: obstacle.thing.friction is -0.1: it must be at least 0");
  refused("shape = { kind = 'half_space' }\nmaterial = 3", "unknown key 'obstacle.thing.material'");
  refused("shape = { kind = 'half_space' }\n[[obstacle.motion]]\nangular_velocity = 3",
          "obstacle.thing.motion.0 lacks the key 'axis'");
  refused("mesh = 'no_such.obj'", "no_such.obj");
  refused("shape = { kind = 'half_space' }\n[[obstacle]]\nname = \"thing\"",
          "the name 'thing' is taken by");
  refused(
      "shape = { kind = 'half_space' }\n[[obstacle]]\nname = \"cube\"\n"
      "shape = { kind = 'half_space' }",
      "obstacle.cube: the name 'cube' is taken by");
  CHECK_THROWS_MATCHES(
      [] {
        ScratchFolder const folder;
        load_scene(folder.write("scene.toml", test::replaced(plain_scene, "kind = \"box\"",
                                                             "inside = true, kind = \"box\"")));
      }(),
      Error, MessageMatches(ContainsSubstring("unknown key 'object.cube.shape.inside'")));
}

TEST_CASE("a run knows its obstacles again") {
  ScratchFolder const folder;
  auto const identity = [&](double bump) {
    TriangleMesh cube = boundary_surface(make_shape(BoxShape{}, 1));
    cube.points[0][0] -= bump;
    write_obj(folder.write("thing.obj", ""), cube);
    Scene const scene = load_scene(folder.write("scene.toml", with("mesh = \"thing.obj\"")));
    return run_identity({}, scene, build_geometry(scene));
  };
  CHECK(identity(0) == identity(0));
  CHECK(identity(0) != identity(1e-3));
}
