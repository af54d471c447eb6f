// `taut run`: what is on disk after a run, a restart, a prolongation and a replacement.
#include <taut/apps/program/commands.hpp>
#include <taut/core/io/checkpoint.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#include <support/data.hpp>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;
namespace fs = std::filesystem;

namespace {

struct Runner {
  test::ScratchFolder folder;
  RunOptions options;

  explicit Runner(std::string const& text = test::plain_scene) {
    options.scene.scene = folder.write("scene.toml", text).string();
    options.out = out("result");
  }
  fs::path out(std::string const& name) const {
    return fs::path(options.scene.scene).parent_path() / name;
  }
  /// Runs with these overrides; the other options stay as they are.
  void run(std::vector<std::string> const& overrides, bool restart = false) {
    options.scene.changes.overrides = overrides;
    options.restart = restart;
    REQUIRE(run_command(options) == 0);
  }
  void refused(std::string const& part) {
    CHECK_THROWS_MATCHES(run_command(options), Error, MessageMatches(ContainsSubstring(part)));
  }
  nlohmann::json summary() const { return test::read_json(options.out / "summary.json"); }
  ResultReader result() const { return ResultReader(options.out / "result.vtkhdf"); }
};

}  // namespace

TEST_CASE("the last state is in the result, whatever `every` says", "[run]") {
  Runner runner;
  runner.run({"output.every=3"});
  CHECK(runner.result().frames() == 3);
  CHECK_THAT(runner.result().times()[1], Catch::Matchers::WithinRel(0.03));
  CHECK_THAT(runner.result().times()[2], Catch::Matchers::WithinRel(0.04));
  CHECK(check_command(runner.options.out) == 0);

  // Prolonged, the state at the old end lies between frames and goes.
  runner.run({"output.every=3", "time.frames=7"}, true);
  REQUIRE(runner.result().frames() == 4);
  CHECK_THAT(runner.result().times()[2], Catch::Matchers::WithinRel(0.06));
  CHECK_THAT(runner.result().times()[3], Catch::Matchers::WithinRel(0.07));
}

TEST_CASE("a run in legs ends as one in one go, and its summary covers all of them", "[run]") {
  Runner runner;
  runner.run({});
  auto const whole = runner.summary();
  ResultReader const at_once = runner.result();

  runner.options.out = runner.out("legs");
  runner.run({"time.frames=2"});
  runner.run({}, true);
  auto const legs = runner.summary();
  {
    ResultReader const in_legs = runner.result();
    REQUIRE(in_legs.frames() == 5);
    for (int k = 0; k < 5; ++k) {
      CHECK(in_legs.positions(k) == at_once.positions(k));
      CHECK(in_legs.velocities(k) == at_once.velocities(k));
    }
  }
  for (char const* key : {"ended", "frames", "steps_converged", "mean_iterations",
                          "largest_error_estimate_m", "most_inverted_elements"}) {
    INFO(key);
    CHECK(legs.at(key) == whole.at(key));
  }
  // Once more, and nothing is left to do: the summary does not forget.
  runner.run({}, true);
  CHECK(runner.summary() == legs);
  CHECK(runner.result().frames() == 5);
}

TEST_CASE("a step that is not wholly written is taken again", "[run]") {
  Runner runner;
  runner.run({"output.obj=true"});
  ResultReader const whole = runner.result();

  // A folder is in the way of the surface of frame 1, which is written after its positions: a
  // restart goes on from the checkpoint before the first step.
  runner.options.out = runner.out("stopped");
  fs::create_directories(runner.options.out / "obj/frame_00001.obj");
  runner.refused("frame_00001.obj");
  CHECK(runner.summary().at("ended") == "stopped by an error");
  CHECK(runner.result().frames() == 2);
  fs::remove(runner.options.out / "obj/frame_00001.obj");
  runner.run({"output.obj=true"}, true);
  REQUIRE(runner.result().frames() == 5);
  for (int k = 0; k < 5; ++k) CHECK(runner.result().positions(k) == whole.positions(k));
  CHECK(runner.summary().at("frames") == 4);
}

TEST_CASE("a restart is refused once anything that matters has changed", "[run]") {
  Runner runner(
      "base = \"base.toml\"\nname = \"derived\"\n[[pin]]\nname = \"more\"\nselect = { "
      "mask = \"mask.npy\" }\n");
  auto const mask = [&](int first) {
    // 27 + 8 centres + 24 faces' middles of a cube of 2 x 2 x 2 cells.
    std::string header = "{'descr': '|b1', 'fortran_order': False, 'shape': (59,), }";
    header.resize(117, ' ');
    std::string bytes = "\x93NUMPY\x01";
    bytes += std::string("\x00\x76\x00", 3) + header + "\n" + std::string(59, '\0');
    bytes[bytes.size() - 1 - static_cast<std::size_t>(first)] = 1;
    runner.folder.write("mask.npy", bytes);
  };
  std::string const base = test::replaced(test::plain_scene,
                                          "[[pin]]\nname = \"floor\"\nselect = "
                                          "{ side = \"y_min\" }\n",
                                          "");
  runner.folder.write("base.toml", base);
  mask(0);
  runner.run({"time.frames=1"});
  runner.options.restart = true;

  runner.folder.write("base.toml", test::replaced(base, "young = 1e5", "young = 2e5"));
  runner.refused(
      "this is not the run that was interrupted: object.cube.material.young = 200000, it was "
      "100000; "
      "undo that");
  runner.folder.write("base.toml", base);
  mask(1);
  runner.refused("what the meshes and masks of the scene hold has changed");
  mask(0);
  runner.options.scene.changes.overrides = {"solver.precision=fp32"};
  runner.refused("solver.precision = fp32, it was fp64");
  runner.options.scene.changes.overrides = {};
  runner.folder.write("base.toml", base + "\n[contact]\n");
  runner.refused("contact = { }, it was not set");
  // More steps, another description and other pictures are the same run.
  runner.folder.write("base.toml", base + "\n[output]\nobj = true\n");
  runner.run({"time.frames=3"}, true);
}

TEST_CASE("a restart may take another solver, and says so", "[run]") {
  Runner emptied(test::plain_scene + "\n[solver]\nmax_iterations = 1\n");
  emptied.run({"time.frames=1"});
  emptied.folder.write("scene.toml", test::plain_scene + "\n[solver]\n");
  // What is the default is no change.
  emptied.run({"time.frames=2", "solver.precision=fp64", "solver.sleep_speed=0"}, true);
  CHECK(emptied.summary().at("solver_changes").size() == 1);

  Runner runner;
  runner.run({"time.frames=1", "solver.max_iterations=1"});
  CHECK(runner.summary().at("steps_converged") == 0);
  CHECK_FALSE(runner.summary().contains("solver_changes"));
  runner.run({"time.frames=2", "solver.method=newton"}, true);
  runner.run({"time.frames=3", "solver.method=newton"}, true);
  auto const summary = runner.summary();
  CHECK(summary.at("frames") == 3);
  CHECK(summary.at("steps_converged") == 2);
  CHECK(summary.at("solver_changes") ==
        std::vector<std::string>{"from step 2 on: solver.max_iterations is not set, it was 1",
                                 "from step 2 on: solver.method = \"newton\", it was not set"});
}

TEST_CASE("what sleeps over a restart wakes as it would have without one", "[run]") {
  // Held by the pin, the first cube falls asleep after three steps; the pin goes, or a force comes,
  // just where the run goes on.
  std::string const scene = test::plain_scene + R"(
[[object]]
name = "other"
shape = { kind = "box", size = [1, 1, 1], resolution = 2 }
translate = [5, 0, 0]
material = { young = 1e5, poisson = 0.4, density = 1000 }

[[force]]
start = 0.03
acceleration = [1, 0, 0]

[contact]

[solver]
sleep_speed = 0.1
sleep_steps = 3
)";
  for (std::string const scheme : {"implicit_euler", "bdf2"}) {
    INFO(scheme);
    Runner runner(test::replaced(scene, "gravity = [0, -10, 0]", "gravity = [0, 0, 0]"));
    std::string const by = "time.integrator=" + scheme;
    runner.run({by});
    ResultReader const whole = runner.result();
    runner.options.out = runner.out("legs");
    runner.run({by, "time.frames=3"});
    runner.run({by}, true);
    ResultReader const legs = runner.result();
    REQUIRE(legs.frames() == 5);
    CHECK(legs.positions(3) == legs.positions(2));
    CHECK(legs.positions(4) != legs.positions(3));
    CHECK(legs.positions(4) == whole.positions(4));
    CHECK(legs.velocities(4) == whole.velocities(4));
  }
}

TEST_CASE("a result that is replaced leaves nothing of the old one", "[run]") {
  Runner runner;
  runner.run({"output.obj=true"});
  CHECK(fs::exists(runner.options.out / "obj/frame_00004.obj"));
  runner.refused("--force");
  runner.options.force = true;
  runner.run({"time.frames=2", "output.obj=true"});
  CHECK(fs::exists(runner.options.out / "obj/frame_00002.obj"));
  CHECK_FALSE(fs::exists(runner.options.out / "obj/frame_00004.obj"));
  CHECK(runner.result().frames() == 3);
  CHECK(runner.summary().at("frames") == 2);
}

TEST_CASE("a file of another run is not overwritten, whichever is left", "[run]") {
  Runner runner;
  for (std::string const name : {"result.xdmf", "report.jsonl", "summary.json", "checkpoint.h5",
                                 "obj/frame_00000.obj", "vdb/frame_00001.vdb"}) {
    CAPTURE(name);
    runner.options.out = runner.out(fs::path(name).stem().string());
    write_file_atomically(runner.options.out / name, "mine");
    runner.refused(name + " of another run is there already: choose another --out or replace it");
    CHECK(read_file(runner.options.out / name) == "mine");
    CHECK_FALSE(fs::exists(runner.options.out / "result.vtkhdf"));
    runner.options.force = true;
    runner.run({"time.frames=1"});
    runner.options.force = false;
    bool const written = fs::exists(runner.options.out / name);
    CHECK((!written || read_file(runner.options.out / name) != "mine"));
  }
}

TEST_CASE("the name of a scene is that of a folder", "[run]") {
  Runner runner;
  runner.options.out.clear();
  for (std::string const name : {"", ".", "..", "../other", "/tmp", "a\nb"}) {
    CAPTURE(name);
    std::ofstream(runner.options.scene.scene)
        << test::replaced(test::plain_scene, "\"plain\"", nlohmann::json(name).dump());
    runner.refused("cannot be the name of a folder");
  }
}

TEST_CASE("check finds inverted elements and the summary counts their steps", "[run]") {
  // A flat start is all inverted, and the first step does not mend all of it.
  Runner runner(test::replaced(test::plain_scene, "material =", "start = \"flat\"\nmaterial ="));
  runner.run({"time.frames=1", "pin.floor.select='all'"});
  CHECK(check_command(runner.options.out) == 0);  // all held at rest
  runner.options.force = true;
  runner.run({"time.frames=1", "object.cube.start='random'", "solver.max_iterations=1"});
  CHECK(check_command(runner.options.out) == 1);
  CHECK(runner.summary().at("steps_with_inverted_elements") == 1);
  CHECK(runner.summary().at("most_inverted_elements") > 0);
}

TEST_CASE("a run whose checkpoint cannot be written does not begin", "[run]") {
  Runner runner;
  runner.run({"time.frames=1"});
  runner.options.force = true;
  fs::create_directories(runner.options.out / ".checkpoint.h5.tmp");
  runner.refused("checkpoint.h5");
}
