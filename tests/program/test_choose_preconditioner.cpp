// The preconditioner that a scene gets where it does not say which.
#include "problem.hpp"

#include <taut/apps/program/choose_preconditioner.hpp>
#include <taut/apps/program/scene.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;

namespace {

PreconditionerChoice choice(std::string const& name, std::vector<std::string> const& overrides) {
  Scene const scene = load_scene(scene_folder() / (name + ".toml"), {true, overrides});
  return choose_preconditioner(scene, build_geometry(scene));
}

}  // namespace

TEST_CASE("a step that reaches over many elements gets a coarse level", "[options]") {
  auto const at = [](std::string const& young) {
    return choice("stiffness_sweep", {"object.body.material.young=" + young});
  };
  CHECK(at("1e4").name == "block_jacobi");
  CHECK_THAT(at("1e4").reason, ContainsSubstring("less than 3"));
  CHECK(at("1e6").name == "schwarz_32");
  CHECK_THAT(at("1e6").reason, ContainsSubstring("no less than 3"));
  CHECK(choice("hanging_bar", {"time.integrator=quasi_static"}).name == "schwarz_32");
}

TEST_CASE("a preconditioner that is asked for is taken", "[options]") {
  PreconditionerChoice const asked =
      choice("stiffness_sweep", {"object.body.material.young=1e8", "solver.preconditioner=jacobi"});
  CHECK(asked.name == "jacobi");
  CHECK(asked.reason == "asked for");
}

TEST_CASE("elements per step go with the root of the modulus, and with the step", "[options]") {
  auto const reach = [](std::vector<std::string> const& overrides) {
    Scene const scene = load_scene(scene_folder() / "stiffness_sweep.toml", {true, overrides});
    return elements_per_step(scene, build_geometry(scene));
  };
  double const one = reach({"object.body.material.young=1e4", "time.step=0.01"});
  CHECK(one > 0.5);
  CHECK(one < 5);
  CHECK_THAT(reach({"object.body.material.young=4e4", "time.step=0.01"}),
             WithinRel(2 * one, 1e-12));
  CHECK_THAT(reach({"object.body.material.young=1e4", "time.step=0.03"}),
             WithinRel(3 * one, 1e-12));
}
