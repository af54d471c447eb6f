// The promise of the solver's defaults: one set of them runs every scene, each step converges, and
// ends as near to the minimum as its error estimate says.
#include <taut/core/io/file.hpp>

#include "../support/data.hpp"
#include "problem.hpp"

using namespace taut;
using namespace taut::test;

namespace {

bool forbids_inversion(Scene const& scene) {
  for (SceneObject const& object : scene.objects) {
    for (MaterialModel const& model : material_models()) {
      if (model.name == object.material.model && !model.allows_inversion) return true;
    }
  }
  return false;
}

/// Steps with the defaults and, from the same states, with projected Newton.
void check_steps(std::string const& name, std::vector<std::string> const& overrides, int frames) {
  INFO(name << (overrides.empty() ? "" : ", " + overrides[0]));
  Trial const trial(name, overrides, true);
  auto exactly = overrides;
  for (auto const& o : of_solver(tight_newton())) exactly.push_back(o);
  Trial const exact(name, exactly, true);
  for (int k = 0; k < std::min(frames, trial.scene.frames); ++k) {
    INFO("step " << k + 1);
    Checkpoint before;
    trial.simulation->save(before);
    exact.simulation->restore(before);
    auto const report = trial.simulation->step();
    CHECK(report.converged());
    CHECK(exact.simulation->step().converged());
    auto const x = trial.simulation->positions();
    INFO(report.iterations << " iterations, error estimate " << report.error_estimate_m << " m");
    // Measured: at most 2.3 times the estimate with inertia. At rest the estimate may end far below
    // the tolerance, and the error 3.5 times above it (cantilever).
    double const allowed = trial.scene.scheme == TimeScheme::quasi_static ? 5 : 3;
    CHECK(rms_difference(trial.geometry, x, exact.simulation->positions()) <
          allowed * report.error_estimate_m);
    if (forbids_inversion(trial.scene)) {
      CHECK(inverted_tets(trial.geometry.mesh, x).empty());
    }
  }
}

}  // namespace

TEST_CASE("with the defaults, every scene's steps converge to Newton's", "[truth]") {
  int scenes = 0;
  for (auto const& entry : std::filesystem::directory_iterator(scene_folder())) {
    std::string const name = entry.path().stem().string();
    if (entry.path().extension() != ".toml" || name == "drag_armadillo") continue;
    // A random start has many minima within reach, and no two methods find the same.
    if (name == "scrambled_random") continue;
    // Those with contact have tests of their own (test_contact_scenes.cpp), or need data.
    if (name.ends_with("_paper") || name.ends_with("_armadillo")) continue;
    // So have those of material points.
    if (read_file(entry.path()).find("\n[grid]") != std::string::npos) continue;
    if (load_scene(entry.path()).contact) continue;
    check_steps(name, {}, 3);
    ++scenes;
  }
  CHECK(scenes >= 15);
  for (char const* young : {"1e6", "1e8"}) {
    check_steps("stiffness_sweep", {std::string("object.body.material.young=") + young}, 2);
  }
}

TEST_CASE("with the defaults, the first steps of scenes in full converge", "[truth]") {
  // Meshes in full have ways for an element to be cut off that coarse ones have not: the pull of
  // pose e is along one axis, which leaves volumes linear in the step but for round-off.
  int scenes = 0;
  for (auto const& entry : std::filesystem::directory_iterator(scene_folder())) {
    std::string const name = entry.path().stem().string();
    if (!name.starts_with("drag") || name == "drag_armadillo") continue;
    INFO(name);
    Trial const trial(name, {});
    for (int k = 0; k < 2; ++k) CHECK(trial.simulation->step().converged());
    ++scenes;
  }
  CHECK(scenes == 8);
}

TEST_CASE("with the defaults, steps from a random start converge", "[truth]") {
  Trial const trial("scrambled_random", {}, true);
  TetMesh const& mesh = trial.geometry.mesh;
  for (int k = 0; k < 3; ++k) CHECK(trial.simulation->step().converged());
  // Measured: 13 are left, of about half of the elements.
  CHECK(inverted_tets(mesh, trial.simulation->positions()).size() <
        inverted_tets(mesh, trial.geometry.start).size() / 4);
}

TEST_CASE("with the defaults, the armadillo's first step converges", "[truth]") {
  data_file("meshes/pncg/Armadillo13K/Armadillo13K.node");
  Trial const trial("drag_armadillo", {}, true);
  auto const report = trial.simulation->step();
  INFO(report.iterations << " iterations, error estimate " << report.error_estimate_m << " m");
  CHECK(report.converged());
}

TEST_CASE("each precision reaches its floor, and says that it is one", "[truth]") {
  // Largest error relative to the largest displacement, where no step lowers the energy any more.
  struct Floor {
    char const* scene;
    char const* precision;
    double error;
  };
  for (auto const& [scene, precision, error] :
       {Floor{"hanging_bar", "fp64", 1e-12}, Floor{"hanging_bar", "mixed", 1e-4},
        Floor{"hanging_bar", "fp32", 1e-4}, Floor{"drag", "fp64", 1e-12},
        Floor{"drag", "mixed", 5e-5}, Floor{"drag", "fp32", 5e-5}}) {
    INFO(scene << " in " << precision);
    Trial const exact(scene, of_solver(tight_newton(1e-14)), true);
    Trial const trial(
        scene, {std::string("solver.precision=") + precision, "solver.tolerance=1e-13"}, true);
    exact.simulation->step();
    auto const report = trial.simulation->step();
    auto const x = trial.simulation->positions(), y = exact.simulation->positions();
    double worst = 0, moved = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        worst = std::max(worst, std::abs(x[i][c] - y[i][c]));
        moved = std::max(moved, std::abs(y[i][c] - exact.geometry.mesh.points[i][c]));
      }
    INFO("stopped: " << to_string(report.stop) << ", after " << report.iterations << " iterations");
    CHECK(worst < error * moved);
    CHECK(report.converged() == (std::string(precision) == "fp64"));
  }
}
