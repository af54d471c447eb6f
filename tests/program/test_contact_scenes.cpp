// The scenes with contact in their small versions: they come to their end, every step converged,
// without an intersection in any step.
#include "command_line.hpp"

#include <taut/apps/program/commands.hpp>
#include <taut/core/io/file.hpp>

#include <fmt/format.h>
#include <catch2/generators/catch_generators.hpp>
#include <support/data.hpp>

using namespace taut;
using namespace taut::test;

namespace {

struct Trial {
  char const* scene;
  int frames;  ///< as many as it takes to touch
};

void runs_clean(Trial const& trial) {
  CAPTURE(trial.scene);
  ScratchFolder const folder;
  RunOptions options;
  options.scene.scene = trial.scene;
  options.scene.changes.small = true;
  options.scene.changes.overrides = {fmt::format("time.frames={}", trial.frames)};
  options.out = folder.write("place", "").parent_path() / "result";
  options.check = CheckRun::every_step;
  CHECK(run_command(options) == 0);
  auto const summary = test::read_json(options.out / "summary.json");
  CHECK(summary.at("ended") == "finished");
  CHECK(summary.at("steps_converged") == trial.frames);
  CHECK(summary.at("most_contacts") > 0);
  CHECK(summary.at("smallest_gap") > 1e-3);
  CHECK(summary.at("steps_with_inverted_elements") == 0);
}

}  // namespace

TEST_CASE("small scenes of letters and blocks run clean", "[contact][scenes]") {
  runs_clean(GENERATE(values<Trial>({{"eight_letters", 25},
                                     {"forty_eight_letters", 6},
                                     {"slope", 30},
                                     {"stack_1e6", 10},
                                     {"drop_stiff", 15}})));
}

TEST_CASE("small scenes of what is long, thin or squeezed run clean", "[contact][scenes]") {
  runs_clean(GENERATE(
      values<Trial>({{"noodles", 6}, {"squeeze", 12}, {"mat_twist", 15}, {"fast_ball", 3}})));
}

TEST_CASE("small tests of one pair run clean", "[contact][scenes]") {
  runs_clean(GENERATE(values<Trial>({{"unit_wedge_wedge", 20},
                                     {"unit_wedge_spike", 20},
                                     {"unit_spike_spike", 20},
                                     {"unit_crack_spike", 20},
                                     {"unit_crack_wedge", 20},
                                     {"unit_edge_spike", 25},
                                     {"unit_cube_spike", 25},
                                     {"unit_cube_wedge", 20},
                                     {"unit_edge_cube", 20},
                                     {"unit_cliff_cube", 20}})));
}
