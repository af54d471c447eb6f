// Every mistake in a scene file is answered by one sentence: where, what, and the mend.

#include <taut/apps/program/scene.hpp>
#include <taut/apps/program/scene_geometry.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#include <cstdlib>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::EndsWith;
using Catch::Matchers::MessageMatches;
using test::plain_scene;
using test::replaced;
using test::ScratchFolder;

namespace {

Scene load(std::string const& text, SceneChanges const& changes = {}) {
  ScratchFolder const folder;
  return load_scene(folder.write("scene.toml", text), changes);
}

void refused(std::string const& text, std::string const& sentence) {
  CHECK_THROWS_MATCHES(load(text), Error, MessageMatches(ContainsSubstring(sentence)));
}

/// The plain scene with one value spoilt.
void spoilt(std::string const& old, std::string const& by, std::string const& sentence) {
  refused(replaced(plain_scene, old, by), sentence);
}

}  // namespace

TEST_CASE("the plain scene loads, with its defaults filled in") {
  Scene const scene = load(plain_scene);
  CHECK(scene.name == "plain");
  CHECK(scene.scheme == TimeScheme::implicit_euler);
  CHECK(scene.objects.at(0).material.model == "stable_neo_hookean");
  CHECK(scene.gravity == Point{0, -10, 0});
  CHECK(scene.output.every == 1);
  CHECK(scene.output.check);
  CHECK(scene.solver.text("method") == "dk");
  CHECK(scene.solver.number("tolerance") == 1e-3);
  CHECK(scene.warnings.empty());
}

TEST_CASE("unknown keys are refused with the nearest known one") {
  spoilt(
      "frames = 4", "frame = 4",
      "scene.toml:6: unknown key 'time.frame', the nearest is 'frames': time knows step, frames, "
      "integrator");
  spoilt("gravity", "gravty", "scene.toml:2: unknown key 'gravty', the nearest is 'gravity'");
  spoilt("young", "yuong",
         "scene.toml:11: unknown key 'object.cube.material.yuong', the nearest is 'young'");
  spoilt("size", "sise", "unknown key 'object.cube.shape.sise', the nearest is 'size'");
  spoilt("side", "sied", "unknown key 'pin.floor.select.sied', the nearest is 'side'");
  refused(plain_scene + "[solver]\ntolerence = 1",
          "unknown key 'solver.tolerence', the nearest is "
          "'tolerance'");
  refused(plain_scene + "[small]\ntime.frme = 1",
          "scene.toml:17: unknown key 'time.frme', the nearest is 'frames'");
  spoilt(
      "kind = \"box\"", "kind = \"bix\"",
      "scene.toml:10: object.cube.shape.kind is 'bix', nearest is 'box': choose one of box, beam,");
  spoilt("young", "model = \"neo_hokean\", young", "nearest is 'neo_hookean'");
  spoilt("name = \"floor\"", "object = \"cub\"", "pin.0.object is 'cub', nearest is 'cube'");
  spoilt("y_min", "y_mix", "nearest is 'y_min'");
}

TEST_CASE("changes of entries that are not there are refused by what is there") {
  auto const refuses = [](std::string const& text, std::string const& change,
                          std::string const& sentence) {
    CHECK_THROWS_MATCHES(load(text, {.overrides = {change}}), Error,
                         MessageMatches(ContainsSubstring(sentence)));
  };
  refuses(plain_scene, "object.zz.material.young=1e5",
          "--set object.zz.material.young=1e5: no object is called 'zz', and none has a table of "
          "that name: there is cube");
  refuses(plain_scene + "[[object]]\nname = \"ball\"\nshape = { kind = \"sphere\" }\n",
          "object.zz.material.young=1e5", "there are cube, ball");
  refuses(plain_scene, "object.materil.young=1e5", "the nearest is 'material'");
  refuses(plain_scene, "object.cube.zz=1", "unknown key 'object.cube.zz'");
  std::string const free = plain_scene.substr(0, plain_scene.find("[[pin]]"));
  refuses(free, "pin.clamp.release=0.5",
          "--set pin.clamp.release=0.5: the scene has no pin to change");
  refused(free + "[pin]\nname = \"floor\"\n", "pin is a table: it must be a list");
}

TEST_CASE("values out of range say the range and its unit") {
  spoilt("poisson = 0.4", "poisson = 0.5",
         "scene.toml:11: object.cube.material.poisson is 0.5: it must be above -1 and below 0.5");
  spoilt("poisson = 0.4", "poisson = -1", "poisson is -1: it must be above -1");
  spoilt("young = 1e5", "young = 0",
         "young is 0: it must be above 0 and at most 1000000000000000 Pa");
  spoilt("young = 1e5", "young = nan", "young is nan: it must be");
  spoilt("young = 1e5", "young = inf", "young is inf: it must be");
  spoilt("density = 1000", "density = -1", "density is -1: it must be above 0");
  spoilt("density = 1000", "density = -1", "kg/m^3");
  spoilt("step = 0.01", "step = 0.0", "scene.toml:5: time.step is 0: it must be above 0");
  spoilt("step = 0.01", "step = -1", "at most 1000000 s");
  spoilt("frames = 4", "frames = 0", "time.frames is 0: it must be at least 1");
  spoilt("frames = 4", "frames = 99999999999", "at most 1000000000 time steps");
  spoilt("resolution = 2", "resolution = 0", "resolution is 0: it must be at least 1");
  spoilt("size = [1, 1, 1]", "size = [1, 0, 1]", "shape.size has an edge of 0 m: it must be");
  spoilt("[0, -10, 0]", "[0, -10, nan]", "gravity[2] is nan");
  refused(plain_scene + "[solver]\nmax_iterations = 0",
          "max_iterations is 0: it must be at least 1");
  refused(plain_scene + "[output]\nevery = 0", "output.every is 0: it must be at least 1");
}

TEST_CASE("wrong types say what is expected") {
  spoilt("frames = 4", "frames = 4.5", "time.frames is a number: it must be a whole number");
  spoilt("frames = 4", "frames = \"4\"", "time.frames is text: it must be a whole number");
  spoilt("step = 0.01", "step = true", "time.step is true or false: it must be a number");
  spoilt("[0, -10, 0]", "-10", "gravity is a whole number: it must be a list of three numbers");
  spoilt("[0, -10, 0]", "[0, -10]", "gravity is a list of 2: it must be a list of three numbers");
  spoilt("name = \"plain\"", "name = 3", "scene.toml:1: name is a whole number: it must be text");
  spoilt("\"plain\"", "2026-11-22", "scene.toml:1: a scene has no dates");
  spoilt("[time]", "[[time]]", "time is a list: it must be a table");
  spoilt("[[object]]", "[object]", "object is a table: it must be a list");
  refused(plain_scene + "[output]\nobj = 1",
          "output.obj is a whole number: it must be true or false");
}

TEST_CASE("what is missing is named") {
  spoilt("step = 0.01\n", "", "scene.toml:4: time lacks the key 'step'");
  spoilt("young = 1e5, ", "", "object.cube.material lacks the key 'young'");
  spoilt("name = \"cube\"\n", "", "scene.toml:8: object.0 lacks the key 'name'");
  spoilt("select = { side = \"y_min\" }\n", "", "scene.toml:13: pin.floor lacks the key 'select'");
  spoilt("resolution = 2", "", "scene.toml:10: this is not TOML");
  spoilt(", resolution = 2", "", "object.cube.shape lacks the key 'resolution'");
  spoilt("shape = { kind = \"box\", size = [1, 1, 1], resolution = 2 }\n", "",
         "object.cube has no geometry: give either a shape or a mesh");
  refused(plain_scene.substr(0, plain_scene.find("[[object]]")), "the scene has no objects");
  refused("", "the scene lacks the key 'time'");
}

TEST_CASE("contradictions are refused") {
  refused(plain_scene + "[[object]]\nname = \"cube\"\n", "the name 'cube' is taken by");
  spoilt("material =", "mesh = \"a.msh\"\nmaterial =", "has both a shape and a mesh");
  spoilt("{ side = \"y_min\" }", "{ side = \"y_min\", mask = \"a\" }",
         "has 2 of the keys box, plane");
  spoilt("{ side = \"y_min\" }", "{ within = 1 }", "has 0 of the keys box, plane");
  spoilt("{ side = \"y_min\" }", "{ box = [[0, 0, 0], [1, 1, 1]], within = 1 }",
         "pin.floor.select.within has no meaning here");
  spoilt("{ side = \"y_min\" }", "{ box = [[0, 2, 0], [1, 1, 1]] }",
         "goes from 2 to 1 m along y: give the lowest corner first");
  spoilt("{ side = \"y_min\" }", "{ plane = { point = [0, 0, 0], normal = [0, 0, 0] } }",
         "normal has length 0: give a direction");
  std::string const start = "name = \"cube\"\nstart = \"flat\"";
  refused(replaced(replaced(plain_scene, "name = \"cube\"", start), "young",
                   "model = \"neo_hookean\", young"),
          "object.cube: neo_hookean is undefined for the collapsed tets");
  refused(plain_scene + "[[pin.motion]]\nangular_velocity = 3\n",
          "scene.toml:16: pin.floor.motion.0 lacks the key 'axis'");
  refused(plain_scene + "[[pin.motion]]\nvelocity = [1, 0, 0]\n[[pin.motion]]\nstart = 3\n",
          "starts at 3 s, before the phase above it ends at inf s");
  refused(plain_scene + "[[pin.motion]]\nstart = 2\nend = 1\n", "end is 1: it must be above 2");
  refused(plain_scene + "[[force]]\nper_vertex = [1, 0, 0]\ntotal = [1, 0, 0]\n",
          "force.0 has 2 of the keys per_vertex, total, acceleration: give one");
  refused(plain_scene + "[sweep]\nkey = \"object.cube.material.young\"\nvalues = []\n",
          "sweep.values is empty");
  refused(
      plain_scene + "[sweep]\nkey = \"object.cube.material.yung\"\nvalues = [1]\n",
      "--set object.cube.material.yung=1: unknown key 'object.cube.material.yung', the nearest is "
      "'young'");
  refused(plain_scene + "[sweep]\nkey = \"object.material.poisson\"\nvalues = [0.3, 0.5]\n",
          "--set object.material.poisson=0.5: object.cube.material.poisson is 0.5: it must be");
}

TEST_CASE("files are looked for beside the scene, then in TAUT_DATA_DIR") {
  ScratchFolder const folder, data;
  std::string const text =
      replaced(plain_scene, "shape = { kind = \"box\", size = [1, 1, 1], resolution = 2 }",
               "mesh = \"body.msh\"");
  auto const scene = folder.write("scene.toml", text);
  char const* before = std::getenv("TAUT_DATA_DIR");
  std::string const kept = before ? before : "";

  ::unsetenv("TAUT_DATA_DIR");
  CHECK_THROWS_MATCHES(load_scene(scene), Error,
                       MessageMatches(ContainsSubstring("scene.toml:10: object.cube.mesh: there is "
                                                        "no file '") &&
                                      ContainsSubstring("set the environment variable")));
  auto const there = data.write("body.msh", "");
  ::setenv("TAUT_DATA_DIR", there.parent_path().c_str(), 1);
  CHECK(std::get<std::filesystem::path>(load_scene(scene).objects.at(0).geometry) == there);
  auto const beside = folder.write("body.msh", "");
  CHECK(std::get<std::filesystem::path>(load_scene(scene).objects.at(0).geometry) == beside);
  std::filesystem::remove(there);
  std::filesystem::remove(beside);
  CHECK_THROWS_MATCHES(
      load_scene(scene), Error,
      MessageMatches(ContainsSubstring(beside.string()) && ContainsSubstring(there.string())));
  if (before)
    ::setenv("TAUT_DATA_DIR", kept.c_str(), 1);
  else
    ::unsetenv("TAUT_DATA_DIR");
  CHECK_THROWS_MATCHES(
      load_scene("no/such/scene.toml"), Error,
      MessageMatches(ContainsSubstring("no/such/scene.toml: there is no such file")));
}

TEST_CASE("a nearly incompressible material is a warning that names and counts its elements") {
  std::string const region =
      "[[object.region]]\nname = \"low\"\nselect = { box = [[-1, -1, -1], [1, 0, 1]] }\n"
      "material = { poisson = 0.495 }\n\n[[pin]]";
  auto const warnings = build_geometry(load(replaced(plain_scene, "[[pin]]", region))).warnings;
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], ContainsSubstring("80 of 144 tets (") &&
                              ContainsSubstring(", ...) have a poisson of 0.495: linear") &&
                              EndsWith("too little"));
  auto const all = build_geometry(load(replaced(plain_scene, "poisson = 0.4", "poisson = 0.499")));
  REQUIRE(all.warnings.size() == 1);
  CHECK_THAT(all.warnings[0], ContainsSubstring("144 of 144 tets (0, 1, 2, 3, 4, 5, ...) have"));
}

TEST_CASE("a material that is unstable at rest is refused, with one that is not") {
  spoilt("poisson = 0.4", "poisson = 0.1",
         "poisson is 0.1: stable_neo_hookean has no stable rest state at or below 0.125: use model "
         "= \"stable_neo_hookean_2018\"");
  for (char const* model : {"stable_neo_hookean_2018", "neo_hookean", "arap", "fixed_corotated"})
    load(replaced(plain_scene, "young = 1e5, poisson = 0.4",
                  fmt::format("model = \"{}\", young = 1e5, poisson = 0", model)));
}

TEST_CASE("only what is near is suggested") {
  refused(plain_scene + "[solver]\nmethod = \"simulated_annealing\"",
          "solver.method is 'simulated_annealing': choose one of dk,");
  refused(plain_scene + "[solver]\ncolour = 1", "unknown key 'solver.colour': solver knows");
}

TEST_CASE("copies and tets are judged entry by entry") {
  auto const copies = [](std::string const& table, std::string const& sentence) {
    spoilt("name = \"cube\"", "name = \"cube\"\ncopies = " + table, sentence);
  };
  copies("3", "scene.toml:10: object.cube.copies is a whole number: it must be a table");
  copies("{ step = [1, 1, 1] }", "object.cube.copies lacks the key 'count'");
  copies("{ count = [1, 2, 3] }", "object.cube.copies lacks the key 'step'");
  copies("{ count = [1, 2], step = [1, 1, 1] }",
         "object.cube.copies.count is a list of 2: it must be a list of three whole numbers");
  copies("{ count = [1, 0, 1], step = [1, 1, 1] }", "copies.count[1] is 0: it must be at least 1");
  copies("{ count = [1, 1.5, 1], step = [1, 1, 1] }", "count[1] is a number: it must be a whole");
  copies("{ count = [1000, 1000, 1000], step = [1, 1, 1] }",
         "asks for 1000000000 copies: it must be at most 100000");
  copies("{ count = [1, 2, 1], step = [1, 0, 1] }",
         "scene.toml:10: object.cube.copies.step is 0 along y, where there are 2 copies");
  copies("{ count = [1, 1, 1], steps = [1, 1, 1] }", "the nearest is 'step'");
  std::string const two =
      replaced(plain_scene, "name = \"cube\"",
               "name = \"cube\"\ncopies = { count = [2, 1, 1], step = [2, 0, 0] }");
  std::string const body = plain_scene.substr(plain_scene.find("[[object]]"));
  refused(two + replaced(body, "\"cube\"", "\"cube-1\""),
          "object.cube-1: the name 'cube-1' is taken by");
  refused(replaced(two, "name = \"floor\"", "object = \"cube-2\""),
          "pin.0.object is 'cube-2', nearest is 'cube-");

  std::string const shape = "{ kind = \"box\", size = [1, 1, 1], resolution = 2 }";
  auto const tets = [&](std::string const& points, std::string const& list,
                        std::string const& sentence) {
    spoilt(shape, "{ kind = \"tets\", points = " + points + ", tets = " + list + " }", sentence);
  };
  std::string const four = "[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]";
  tets(four, "[[0, 1, 2]]",
       "shape.tets[0] is a list of 3: a tet is a list of the numbers of four points");
  tets(four, "[[0, 1, 2, 4]]", "shape.tets[0][3] is 4: it must be at least 0 and at most 3");
  tets(four, "[[0, 1, 2, -1]]", "shape.tets[0][3] is -1");
  tets("[[0, 0]]", "[[0, 1, 2, 3]]",
       "points[0] is a list of 2: it must be a list of three numbers");
  tets("[]", "[[0, 1, 2, 3]]", "shape.points is empty: give the points that the tets name");
  auto const build_refused = [&](std::string const& list, std::string const& sentence) {
    CHECK_THROWS_MATCHES(build_geometry(load(replaced(
                             plain_scene, shape,
                             "{ kind = \"tets\", points = " + four + ", tets = " + list + " }"))),
                         Error, MessageMatches(ContainsSubstring(sentence)));
  };
  build_refused("[]", "object.cube.shape");
  build_refused("[[0, 1, 2, 2]]", "of zero volume");
  build_refused("[[0, 1, 2, 3], [0, 1, 2, 3]]", "object.cube.shape");
  refused(
      replaced(plain_scene, "resolution = 2", "resolution = 100000") + "[small]\nresolution = 20\n",
      "scene.toml:10: the resolution 100000 of object.cube.shape, times that of the scene, 20, is "
      "above 1000000 cells: lower one");
}
