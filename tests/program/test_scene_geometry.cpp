// From scene to mesh and prescribed data: placement, selections, velocities, starts, regions,
// forces.

#include <taut/apps/program/scene_geometry.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
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
using test::replaced;
using test::ScratchFolder;

namespace {

SceneGeometry build(std::string const& text) {
  ScratchFolder const folder;
  return build_geometry(load_scene(folder.write("scene.toml", text)));
}

/// Number of vertices that the pin of the plain scene holds with this selection.
std::size_t pinned(std::string const& select) {
  return build(replaced(plain_scene, "{ side = \"y_min\" }", select)).pins.at(0).vertices.size();
}

std::string npy(std::string const& type, std::size_t count, std::string const& data) {
  std::string header = "{'descr': '" + type + "', 'fortran_order': False, 'shape': (" +
                       std::to_string(count) + ",), }";
  header.resize(117, ' ');
  header += '\n';
  return std::string("\x93NUMPY\x01\x00", 8) + static_cast<char>(118) + '\0' + header + data;
}

}  // namespace

TEST_CASE("objects are scaled, then rotated, then translated") {
  SceneGeometry const geometry = build(replaced(plain_scene, "name = \"cube\"", R"(name = "cube"
scale = 2
rotate = { axis = [0, 0, 2], angle = 90 }
translate = [10, 20, 30])"));
  // The corner (-0.5, -0.5, -0.5) is first: scaled to -1, turned to (1, -1, -1).
  CHECK_THAT(geometry.mesh.points[0][0], WithinAbs(11, 1e-12));
  CHECK_THAT(geometry.mesh.points[0][1], WithinAbs(19, 1e-12));
  CHECK_THAT(geometry.mesh.points[0][2], WithinAbs(29, 1e-12));
  CHECK(geometry.start == geometry.mesh.points);
}

TEST_CASE("selections") {
  // The cube of 2 x 2 x 2 cells has 27 corners, 8 centres and 24 boundary face centres.
  CHECK(pinned("\"all\"") == 59);
  CHECK(pinned("{ side = \"y_min\" }") == 13);
  CHECK(pinned("{ side = \"z_max\" }") == 13);
  CHECK(pinned("{ side = \"x_max\", within = 0.25 }") == 13 + 4 + 8);
  CHECK(pinned("[{ side = \"y_min\" }, { side = \"y_max\" }]") == 26);
  CHECK(pinned("[{ side = \"y_min\" }, { side = \"x_min\" }]") == 23);
  CHECK(pinned("{ box = [[-0.5, -0.5, -0.5], [0.5, -0.5, 0.5]] }") == 13);
  CHECK(pinned("{ plane = { point = [0, 0.5, 0], normal = [0, -3, 0] } }") == 13);
  CHECK(pinned("{ plane = { point = [0, 0, 0], normal = [1, 1, 0] }, within = 0.01 }") ==
        3 * 3 + 2 * 2 + 2 * 2);
  CHECK(pinned("{ sphere = { centre = [0, 0, 0], radius = 0.5 } }") == 1 + 8 + 6);
}

TEST_CASE("masks are int32 or bool arrays of the right length") {
  ScratchFolder const folder;
  auto const scene = folder.write(
      "scene.toml", replaced(plain_scene, "{ side = \"y_min\" }", "{ mask = \"mask.npy\" }"));
  auto const pinned_by = [&](std::string const& bytes) {
    folder.write("mask.npy", bytes);
    return build_geometry(load_scene(scene)).pins.at(0).vertices;
  };
  std::string flags(59, '\0');
  flags[3] = flags[57] = 1;
  std::string integers(4 * 59, '\0');
  integers[4 * 3] = 1;
  integers[4 * 57 + 1] = 1;  // 256
  CHECK(pinned_by(npy("|b1", 59, flags)) == std::vector<std::int32_t>{3, 57});
  CHECK(pinned_by(npy("<i4", 59, integers)) == std::vector<std::int32_t>{3, 57});

  auto const refused = [&](std::string const& bytes, std::string const& part) {
    CHECK_THROWS_MATCHES(pinned_by(bytes), Error, MessageMatches(ContainsSubstring(part)));
  };
  refused("", "no .npy file");
  refused("something quite different", "no .npy file");
  refused(npy("|b1", 59, flags).substr(0, 60), "header is cut off");
  refused(npy("<f8", 59, flags), "not int32 or bool");
  refused(npy("<i4", 59, flags), "file is cut off");
  refused(npy("<i4", 99999999999999999, flags), "file is cut off");
  refused(npy("|b1", 58, flags), "58 entries");
  refused(replaced(npy("|b1", 59, flags), "(59,)", "(1,59)"), "one-dimensional");
  refused(replaced(npy("|b1", 59, flags), "shape", "shope"), "no shape");
}

TEST_CASE("initial velocity: linear, rotation, twist") {
  SceneGeometry const spin = build(replaced(
      plain_scene, "name = \"cube\"",
      "name = \"cube\"\nvelocity = { linear = [0, 0, 7], axis = [0, 2, 0], centre = [0.5, 0, 0], "
      "angular_velocity = 180 }"));
  // At (-0.5, -0.5, -0.5): arm (-1, ., -0.5), omega x arm = pi (z, ., -x) = pi (-0.5, 0, 1).
  CHECK_THAT(spin.velocity[0][0], WithinAbs(-std::numbers::pi / 2, 1e-12));
  CHECK_THAT(spin.velocity[0][1], WithinAbs(0, 1e-12));
  CHECK_THAT(spin.velocity[0][2], WithinAbs(7 + std::numbers::pi, 1e-12));

  SceneGeometry const column =
      build_geometry(load_scene(test::scene_folder() / "twisting_column.toml"));
  double largest = 0;
  for (std::size_t v = 0; v < column.velocity.size(); ++v) {
    Point const& x = column.mesh.points[v];
    double const rate = 105 * std::sin(std::numbers::pi * x[1] / 12);
    REQUIRE_THAT(column.velocity[v][0], WithinAbs(rate * x[2], 1e-9));
    REQUIRE_THAT(column.velocity[v][1], WithinAbs(0, 1e-9));
    REQUIRE_THAT(column.velocity[v][2], WithinAbs(-rate * x[0], 1e-9));
    largest = std::max(largest, norm(column.velocity[v]));
  }
  CHECK_THAT(largest, WithinRel(105 * std::sqrt(0.5), 1e-9));
}

TEST_CASE("scrambled starts: flat on a plane, random in a box, the same every time") {
  std::string const flat = replaced(plain_scene, "name = \"cube\"",
                                    "name = \"cube\"\ntranslate = [0, 3, 0]\nstart = \"flat\"");
  std::string const free = flat.substr(0, flat.find("[[pin]]"));
  SceneGeometry const pressed = build(free);
  for (std::size_t v = 0; v < pressed.start.size(); ++v) {
    REQUIRE(pressed.start[v][0] == pressed.mesh.points[v][0]);
    REQUIRE_THAT(pressed.start[v][1], WithinAbs(3, 1e-14));
  }

  std::string const random =
      replaced(free, "\"flat\"", "{ kind = \"random\", seed = 5, box = [[1, 2, 3], [2, 3, 4]] }");
  SceneGeometry const scattered = build(random);
  Point mean{};
  for (Point const& x : scattered.start) {
    for (std::size_t a = 0; a < 3; ++a)
      REQUIRE((x[a] >= 1 + static_cast<double>(a) && x[a] <= 2 + static_cast<double>(a)));
    mean = mean + (1.0 / 59) * x;
  }
  CHECK_THAT(mean[0], WithinAbs(1.5, 0.2));  // five standard deviations of the mean of 59
  CHECK(build(random).start == scattered.start);
  CHECK(build(replaced(random, "seed = 5", "seed = 6")).start != scattered.start);

  // What is pinned starts where it is held.
  SceneGeometry const held = build(flat);
  for (std::int32_t const v : held.pins.at(0).vertices)
    CHECK(held.start[static_cast<std::size_t>(v)] == held.mesh.points[static_cast<std::size_t>(v)]);
}

TEST_CASE(
    "regions take tets by their centroid; later ones win and keys left out are the object's") {
  SceneGeometry const geometry = build(replaced(plain_scene, "\n[[pin]]", R"(
[[object.region]]
select = { box = [[-1, -1, -1], [0, 1, 1]] }
material = { young = 7e5 }

[[object.region]]
select = { box = [[-1, -1, -1], [0, 0, 1]] }
material = { model = "arap", density = 5 }

[[pin]])"));
  REQUIRE(geometry.materials.size() == 3);
  CHECK(geometry.materials[1].young == 7e5);
  CHECK(geometry.materials[1].density == 1000);
  CHECK(geometry.materials[2].young == 1e5);
  CHECK(geometry.materials[2].model == "arap");
  for (std::size_t t = 0; t < geometry.mesh.tets.size(); ++t) {
    Point c{};
    for (std::int32_t const v : geometry.mesh.tets[t])
      c = c + 0.25 * geometry.mesh.points[static_cast<std::size_t>(v)];
    std::int32_t const expected = c[0] > 1e-9 ? 0 : c[1] > 1e-9 ? 1 : 2;
    REQUIRE(geometry.material_of_tet[t] == expected);
  }
}

TEST_CASE("forces: per vertex, a total spread by area, an acceleration; on one object or all") {
  std::string const two = plain_scene + R"(
[[object]]
name = "ball"
shape = { kind = "sphere", radius = 0.5, resolution = 2 }
translate = [5, 0, 0]
material = { young = 1e5, poisson = 0.4, density = 1000 }

[[force]]
object = "ball"
per_vertex = [1, 2, 3]

[[force]]
object = "cube"
select = { side = "x_max" }
total = [0, 6, 0]
start = 1
end = 2

[[force]]
acceleration = [0, 0, 9]
)";
  SceneGeometry const geometry = build(two);
  REQUIRE(geometry.objects.size() == 2);
  CHECK(geometry.objects[1].first_vertex == 59);
  CHECK(geometry.objects[1].name == "ball");
  CHECK(geometry.object_of_tet.front() == 0);
  CHECK(geometry.object_of_tet.back() == 1);
  CHECK(geometry.pins.at(0).vertices.size() == 13 + 1);  // the side of each object on its own

  REQUIRE(geometry.forces.size() == 3);
  CHECK(geometry.forces[0].vertices.front() == 59);
  CHECK(geometry.forces[0].force.back() == Point{1, 2, 3});
  Force const& spread = geometry.forces[1];
  REQUIRE(spread.vertices.size() == 13);
  // Four squares of four triangles: middles carry 1/12 of the total each (four thirds of 1/16), and
  // the corners of squares what their 2, 4 or 8 triangles bring.
  double total = 0, largest = 0;
  for (Point const& f : spread.force) {
    total += f[1];
    largest = std::max(largest, f[1]);
  }
  CHECK_THAT(total, WithinRel(6.0, 1e-13));
  CHECK_THAT(largest, WithinRel(6.0 * 8 / 48, 1e-12));
  CHECK(spread.window.start == 1);
  CHECK(spread.window.end == 2);
  CHECK(geometry.forces[2].vertices.size() == geometry.mesh.points.size());
  CHECK(geometry.forces[2].acceleration == Point{0, 0, 9});
}

TEST_CASE("geometry that cannot be simulated is refused with a sentence") {
  auto const refused = [](std::string const& text, std::string const& part) {
    CHECK_THROWS_MATCHES(build(text), Error, MessageMatches(ContainsSubstring(part)));
  };
  refused(replaced(plain_scene, "{ side = \"y_min\" }", "{ box = [[5, 5, 5], [6, 6, 6]] }"),
          "scene.toml:13: pin.floor selects no vertex");
  refused(plain_scene + "[[pin]]\nname = \"wall\"\nselect = { side = \"x_min\" }\n",
          "scene.toml:16: pin.wall and pin.floor both hold vertex");
  refused(plain_scene +
              "[[force]]\nselect = { sphere = { centre = [0, 0, 0], radius = 0.1 } }\n"
              "total = [1, 0, 0]\n",
          "force.0 selects no whole face");
  refused(replaced(plain_scene, "\n[[pin]]",
                   "[[object.region]]\nselect = { sphere = { centre = [9, 9, 9], radius = 1 } }\n"
                   "material = { young = 1 }\n[[pin]]"),
          "object.cube.region.0 selects no tet of 'cube'");
  refused(replaced(plain_scene, "{ kind = \"box\", size = [1, 1, 1], resolution = 2 }",
                   "{ kind = \"letter_e\", resolution = 10 }"),
          "object.cube.shape: the letter E has resolution 10");
}

TEST_CASE("copies are objects of their own; pins, forces and regions reach all of them") {
  std::string const block = replaced(plain_scene, "name = \"cube\"", R"(name = "cube"
translate = [10, 0, 0]
velocity = { axis = [0, 1, 0], centre = [10, 0, 0], angular_velocity = 180 }
copies = { count = [2, 1, 3], step = [2, 0, -3] })") +
                            R"(
[[object]]
name = "ball"
shape = { kind = "sphere", radius = 0.5, resolution = 2 }
translate = [-5, 0, 0]
material = { young = 1e5, poisson = 0.4, density = 1000 }

[[force]]
object = "cube"
acceleration = [1, 0, 0]

[[force]]
object = "cube-4"
acceleration = [2, 0, 0]
)";
  SceneGeometry const geometry = build(block);
  REQUIRE(geometry.objects.size() == 7);
  std::size_t const vertices = 59;
  for (std::size_t copy = 0; copy < 6; ++copy) {
    ObjectPart const& part = geometry.objects[copy];
    CHECK(part.name == "cube-" + std::to_string(copy));
    CHECK(part.first_vertex == static_cast<std::int32_t>(copy * vertices));
    Point const way{2.0 * static_cast<double>(copy % 2), 0, -3.0 * static_cast<double>(copy / 2)};
    for (std::size_t v = 0; v < vertices; ++v) {
      Point const& x = geometry.mesh.points[copy * vertices + v];
      REQUIRE_THAT(norm(x - geometry.mesh.points[v] - way), WithinAbs(0, 1e-12));
      REQUIRE_THAT(norm(geometry.velocity[copy * vertices + v] - geometry.velocity[v]),
                   WithinAbs(0, 1e-12));  // each turns about its own centre
    }
  }
  CHECK(geometry.objects[6].name == "ball");
  CHECK(geometry.pins.at(0).vertices.size() == 6 * 13 + 1);
  CHECK(geometry.forces.at(0).vertices.size() == 6 * vertices);
  REQUIRE(geometry.forces.at(1).vertices.size() == vertices);
  CHECK(geometry.forces.at(1).vertices.front() == static_cast<std::int32_t>(4 * vertices));
}

TEST_CASE("tets are given one by one, as they are or finer") {
  std::string const pyramid =
      "{ kind = \"tets\", points = [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [0.5, 3, 0.5]], "
      "tets = [[0, 2, 1, 4], [3, 2, 0, 4]]@ }";
  std::string const old = "{ kind = \"box\", size = [1, 1, 1], resolution = 2 }";
  auto const with = [&](std::string const& more) {
    return build(replaced(plain_scene, old, replaced(pyramid, "@", more))).mesh;
  };
  CHECK(with("").tets.size() == 2);
  CHECK(with("").points.size() == 5);
  CHECK(with("").points[4] == Point{0.5, 3, 0.5});
  CHECK(with(", resolution = 3").tets.size() == 2 * 27);
}
