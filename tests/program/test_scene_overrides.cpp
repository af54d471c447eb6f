// Changes laid over a scene: --set, [small], base and sweeps; all judged like the file itself.

#include <taut/apps/program/scene.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;
using test::plain_scene;
using test::replaced;
using test::ScratchFolder;

namespace {

Scene load(std::string const& text, std::vector<std::string> const& overrides, bool small = false) {
  ScratchFolder const folder;
  return load_scene(folder.write("scene.toml", text), {.small = small, .overrides = overrides});
}

std::string const two_objects = plain_scene + R"(
[[object]]
name = "ball"
shape = { kind = "sphere", radius = 0.5, resolution = 2 }
material = { young = 2e5, poisson = 0.3, density = 900 }

[small]
time.frames = 2
object.ball.shape.resolution = 1
)";

}  // namespace

TEST_CASE("overrides: --set changes and adds values; the last one wins") {
  Scene const scene =
      load(two_objects,
           {"time.step=0.5", "time.step = 0.25", "solver.tolerance=1e-4", "solver.method=newton",
            "solver.precision='fp32'", "gravity=[0, 0, 1]", "output.obj=true"});
  CHECK(scene.step == 0.25);
  CHECK(scene.solver.number("tolerance") == 1e-4);
  CHECK(scene.solver.text("method") == "newton");
  CHECK(scene.solver.text("precision") == "fp32");
  CHECK(scene.gravity == Point{0, 0, 1});
  CHECK(scene.output.obj);
}

TEST_CASE("a key under an array of tables means one entry by name or index, or all of them") {
  auto const young = [](std::string const& override) {
    Scene const scene = load(two_objects, {override});
    return std::array{scene.objects[0].material.young, scene.objects[1].material.young};
  };
  CHECK(young("object.ball.material.young=7") == std::array{1e5, 7.0});
  CHECK(young("object.0.material.young=7") == std::array{7.0, 2e5});
  CHECK(young("object.material.young=7") == std::array{7.0, 7.0});
}

TEST_CASE("an inline table replaces, dotted keys merge") {
  Scene const scene =
      load(two_objects, {"object.cube.shape={kind='sphere', radius=2, resolution=3}",
                         "object.cube.shape.resolution=4", "pin.floor.select='all'"});
  auto const& shape = std::get<ProceduralShape>(scene.objects[0].geometry);
  CHECK(std::get<SphereShape>(shape.shape).radius == 2);
  CHECK(shape.resolution == 4);
  CHECK(std::holds_alternative<SelectAll>(scene.pins[0].selection.at(0)));
}

TEST_CASE("[small] applies on request, before --set") {
  CHECK(load(two_objects, {}).frames == 4);
  Scene const small = load(two_objects, {}, true);
  CHECK(small.frames == 2);
  CHECK(std::get<ProceduralShape>(small.objects[1].geometry).resolution == 1);
  CHECK(load(two_objects, {"time.frames=9"}, true).frames == 9);
}

TEST_CASE("a scene may stand on a base") {
  ScratchFolder const folder;
  folder.write("base.toml", two_objects);
  auto const scene = folder.write("scene.toml", R"(base = "base.toml"
name = "derived"
object.ball.material.young = 3
[[force]]
acceleration = [1, 0, 0]
[small]
time.step = 1
)");
  Scene const derived = load_scene(scene);
  CHECK(derived.name == "derived");
  CHECK(derived.objects.size() == 2);
  CHECK(derived.objects[1].material.young == 3);
  CHECK(derived.forces.size() == 1);
  Scene const small = load_scene(scene, {.small = true, .overrides = {}});
  CHECK(small.frames == 2);
  CHECK(small.step == 1);

  auto const refused = [&](std::string const& text, std::string const& part) {
    CHECK_THROWS_MATCHES(load_scene(folder.write("other.toml", text)), Error,
                         MessageMatches(ContainsSubstring(part)));
  };
  refused("base = \"none.toml\"", "none.toml: there is no such file");
  refused("base = \"other.toml\"", "circle");
  refused("base = 3", "base is a whole number: it must be text");
  refused("base = \"base.toml\"\nobject.ball.material.yung = 3",
          "other.toml:2: unknown key 'object.ball.material.yung', the nearest is 'young'");
}

TEST_CASE("sweeps name a key and its values") {
  Scene const scene = load(
      two_objects + "[sweep]\nkey = \"object.ball.material.young\"\nvalues = [1e4, 100, 2.5]\n",
      {});
  REQUIRE(scene.sweep);
  CHECK(scene.sweep->key == "object.ball.material.young");
  CHECK(scene.sweep->values == std::vector<double>{1e4, 100, 2.5});
  CHECK(load(two_objects + "[sweep]\nkey = \"time.frames\"\nvalues = [1, 10]\n", {}).sweep);
}

TEST_CASE("overrides are judged like the file, and named in the sentence") {
  auto const refused = [](std::string const& override, std::string const& sentence) {
    CHECK_THROWS_MATCHES(load(two_objects, {override}), Error,
                         MessageMatches(ContainsSubstring(sentence)));
  };
  refused("solver.tolerance=2",
          "--set solver.tolerance=2: solver.tolerance is 2: it must be above 0 and at most 1");
  refused("solver.tolerence=1",
          "--set solver.tolerence=1: unknown key 'solver.tolerence', the "
          "nearest is 'tolerance'");
  refused("object.material.poisson=0.5", "object.cube.material.poisson is 0.5");
  refused("solver.method=newtn", "solver.method is 'newtn', nearest is 'newton'");
  refused("resolution=0", "--set resolution=0: resolution is 0: it must be above 0");
  refused("resolution=-1", "resolution is -1: it must be above 0 and at most 1000");
  refused("object.cube.copies.count=[2,1,1]", "object.cube.copies lacks the key 'step'");
  refused("time.step=fast", "time.step is text: it must be a number");
  refused("solver.safeguard=yes", "solver.safeguard is text: it must be true or false");
  refused("time.step", "there is no '='");
  refused("time..step=1", "a part of the key is empty");
  refused("=1", "a part of the key is empty");
  refused("time.step.x=1", "time.step is a table: it must be a number");
  refused("name.x=1", "name is a table: it must be text");
}

TEST_CASE("the resolution of a scene is a factor for every shape, in steps that the shape has") {
  auto const resolution = [](std::string const& shape, double factor) {
    std::string const text =
        replaced(plain_scene, "{ kind = \"box\", size = [1, 1, 1], resolution = 2 }", shape);
    Scene const scene = load(text, {"resolution=" + std::to_string(factor)});
    return std::get<ProceduralShape>(scene.objects[0].geometry).resolution;
  };
  std::string const ball = "{ kind = \"sphere\", radius = 1, resolution = 6 }";
  CHECK(resolution(ball, 1) == 6);
  CHECK(resolution(ball, 2) == 12);
  CHECK(resolution(ball, 0.4) == 2);
  CHECK(resolution(ball, 0.001) == 1);
  std::string const letter = "{ kind = \"letter_e\", resolution = 18 }";
  CHECK(resolution(letter, 1.5) == 27);
  CHECK(resolution(letter, 1.2) == 18);
  CHECK(resolution(letter, 0.1) == 9);
  std::string const step =
      "{ kind = \"boxes\", boxes = [[[0, 0, 0], [3, 1, 1]], [[0, 1, 0], [1, 2, 1]]], resolution = "
      "3 }";
  CHECK(resolution(step, 0.5) == 3);
  CHECK(resolution(step, 3.2) == 9);
  std::string const tet =
      "{ kind = \"tets\", points = [[0,0,0], [1,0,0], [0,1,0], [0,0,1]], tets = [[0,1,2,3]] }";
  CHECK(resolution(tet, 3) == 3);

  // Of obstacles too, in files and their small versions, and by itself in no scene of files.
  std::string const bowl = two_objects +
                           "[[obstacle]]\nname = \"bowl\"\nshape = { kind = \"bowl\", radius = 1, "
                           "thickness = 0.1, height = 1, resolution = 5 }\n";
  Scene const scene = load(bowl, {"resolution=3"}, true);
  CHECK(scene.resolution == 3);
  CHECK(std::get<ProceduralShape>(scene.objects[1].geometry).resolution == 3);
  CHECK(std::get<ProceduralShape>(scene.obstacles[0].geometry).resolution == 15);
  CHECK(load("resolution = 2\n" + plain_scene, {}).resolution == 2);
  CHECK(scene.warnings.empty());
  ScratchFolder const folder;
  folder.write("body.msh", "");
  auto const file = folder.write(
      "scene.toml",
      replaced(plain_scene, "shape = { kind = \"box\", size = [1, 1, 1], resolution = 2 }",
               "mesh = \"body.msh\""));
  CHECK(load_scene(file).warnings.empty());
  auto const warned = load_scene(file, {.small = false, .overrides = {"resolution=2"}}).warnings;
  REQUIRE(warned.size() == 1);
  CHECK_THAT(warned[0], ContainsSubstring("resolution = 2 changes nothing"));
}

TEST_CASE("a change to the name of copies reaches all of them") {
  std::string const text =
      replaced(plain_scene, "name = \"cube\"",
               "name = \"cube\"\ncopies = { count = [2, 2, 1], step = [2, 2, 2] }");
  Scene const scene = load(text, {"object.cube.material.young=7"});
  REQUIRE(scene.objects.size() == 4);
  for (SceneObject const& object : scene.objects) CHECK(object.material.young == 7);
}
