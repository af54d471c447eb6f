// The measure of charts is independent of what it judges: it must agree with the energies that the
// minimisers see.
#include <taut/apps/chart/measure.hpp>
#include <taut/apps/program/simulation.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

std::vector<std::string> const newton{"solver.method=newton", "solver.precision=fp64",
                                      "solver.linear_tolerance=1e-6", "solver.tolerance=1e-10",
                                      "object.cube.material.young=2e4"};

}  // namespace

TEST_CASE("the energy gap is what a minimiser still has to lose", "[chart]") {
  std::string const model = GENERATE("arap", "fixed_corotated", "neo_hookean", "stable_neo_hookean",
                                     "stable_neo_hookean_2018");
  std::string const scheme = GENERATE("implicit_euler", "bdf2", "quasi_static");
  CAPTURE(model, scheme);
  test::ScratchFolder const folder;
  SceneChanges changes{false, newton};
  changes.overrides.push_back("object.cube.material.model=" + model);
  changes.overrides.push_back("time.integrator=" + scheme);
  Scene const scene = load_scene(folder.write("plain.toml", test::plain_scene), changes);
  SceneGeometry const geometry = build_geometry(scene);
  auto const simulation = Simulation::create(scene, geometry);

  int const before_that = scheme == "bdf2" ? 1 : 0;  // it begins with a step of implicit Euler
  for (int k = 0; k < before_that; ++k) simulation->step();
  std::vector<Point> const before = simulation->positions();
  std::vector<std::vector<Point>> iterates;
  std::vector<double> change;
  simulation->step([&](IterationView const& view) {
    iterates.push_back(view.positions());
    change.push_back(view.energy_change);
  });
  REQUIRE(iterates.size() >= 3);
  // The last iterate is exact far beyond the margin below.
  MeshMeasure const measure(scene, geometry, before_that + 1, before, simulation->positions());
  double const lost = change.front() - change.back();
  REQUIRE(lost > 0);
  for (std::size_t k = 0; k + 1 < iterates.size(); ++k) {
    CAPTURE(k);
    CHECK_THAT(measure.energy_above(iterates[k]) - measure.energy_above(iterates[k + 1]),
               WithinAbs(change[k] - change[k + 1], 1e-6 * lost));
  }
  CHECK(measure.energy_above(simulation->positions()) == 0);
}

TEST_CASE("both measures are one at the beginning of the step", "[chart]") {
  test::ScratchFolder const folder;
  Scene const scene = load_scene(folder.write("plain.toml", test::plain_scene), {false, newton});
  SceneGeometry const geometry = build_geometry(scene);
  auto const simulation = Simulation::create(scene, geometry);
  std::vector<Point> const before = simulation->positions();
  simulation->step();
  std::vector<Point> const solution = simulation->positions();

  MeshMeasure const measure(scene, geometry, 1, before, solution);
  CHECK(measure.position_error(before) == 1);
  CHECK(measure.position_error(solution) == 0);
  CHECK(measure.energy_gap(before) == 1);
  CHECK(measure.energy_gap(solution) == 0);

  // Half of the way in position is a quarter of the way in a nearly quadratic energy.
  std::vector<Point> half = before;
  for (std::size_t i = 0; i < half.size(); ++i)
    for (int c = 0; c < 3; ++c) half[i][c] = 0.5 * (before[i][c] + solution[i][c]);
  CHECK_THAT(measure.position_error(half), WithinRel(0.5, 1e-9));
  CHECK_THAT(measure.energy_gap(half), WithinRel(0.25, 0.02));

  MeshMeasure const absolute(scene, geometry, 1, before, solution, 2.0);
  CHECK_THAT(absolute.position_error(half), WithinRel(measure.length() / 4, 1e-9));

  half[3][1] = std::numeric_limits<double>::quiet_NaN();
  CHECK(std::isnan(measure.position_error(half)));
  CHECK_THROWS_AS(MeshMeasure(scene, geometry, 1, before, before), Error);
}
