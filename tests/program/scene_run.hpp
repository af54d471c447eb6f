// A run of a scene in a folder of its own, and what it leaves there.
#pragma once

#include "scene_text.hpp"

#include <taut/apps/program/commands.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/io/vtkhdf.hpp>

#include <support/data.hpp>

#include <catch2/catch_test_macros.hpp>

#include <sstream>
#include <vector>

namespace taut::test {

struct SceneRun {
  ScratchFolder folder;
  RunOptions options;

  /// `name`: of the scene's file, as messages call it.
  SceneRun(std::string const& name, std::string const& text,
           std::vector<std::string> overrides = {}, CheckRun check = CheckRun::off) {
    options.scene.scene = folder.write(name, text).string();
    options.scene.changes.overrides = std::move(overrides);
    options.out = std::filesystem::path(options.scene.scene).parent_path() / "result";
    options.check = check;
  }
  Scene scene() const { return load_scene(options.scene.scene, options.scene.changes); }
  ResultReader result() const { return ResultReader(options.out / "result.vtkhdf"); }
  nlohmann::json summary() const { return test::read_json(options.out / "summary.json"); }
  std::vector<nlohmann::json> report() const {
    std::vector<nlohmann::json> lines;
    std::istringstream text(read_file(options.out / "report.jsonl"));
    for (std::string line; std::getline(text, line);) lines.push_back(test::parse_json(line));
    return lines;
  }
};

/// Runs both, the second one in two legs (its overrides end the first), and checks that they leave
/// the same, bit for bit.
inline void check_goes_on(SceneRun& whole, SceneRun& legs) {
  REQUIRE(run_command(whole.options) == 0);
  REQUIRE(run_command(legs.options) == 0);
  REQUIRE(legs.result().frames() < whole.result().frames());
  legs.options.restart = true;
  legs.options.scene.changes.overrides = {};
  REQUIRE(run_command(legs.options) == 0);
  ResultReader const one = whole.result(), other = legs.result();
  REQUIRE(one.frames() == other.frames());
  for (std::int64_t frame = 0; frame < one.frames(); ++frame) {
    INFO("frame " << frame);
    CHECK(one.positions(frame) == other.positions(frame));
    CHECK(one.velocities(frame) == other.velocities(frame));
  }
}

}  // namespace taut::test
