// Charts of scenes of material points: the nodes of the first step of the grid in a frame.
#include <taut/apps/chart/scene.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include "chart_data.hpp"

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;

namespace {

/// A bar of two stiffnesses that is thrown, and held at one end.
std::string const bar = R"(name = "bar"
gravity = [0, -10, 0]

[time]
step = 0.02
frames = 3

[grid]
spacing = 0.1

[[object]]
name = "soft"
shape = { kind = "box", size = [0.4, 0.3, 0.3] }
velocity = { linear = [0, 2, 0] }
material = { young = 1e4, poisson = 0.3, density = 1000 }

[[object]]
name = "stiff"
shape = { kind = "box", size = [0.4, 0.3, 0.3] }
translate = [0.4, 0, 0]
material = { young = 1e6, poisson = 0.3, density = 1000 }

[[boundary]]
name = "hold"
shape = { kind = "box", size = [0.1, 1, 1] }
translate = [-0.2, 0, 0]

[sweep]
key = "object.stiff.material.young"
values = [1e4, 1e6]
)";

}  // namespace

TEST_CASE("minimisers over particles meet at the solution of the reference", "[chart][mpm]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, bar);
  options.methods = {"lbfgs", "hot", "pn_pcg", "dk:preconditioner=block_jacobi"};
  Data const data = chart(options);
  CHECK_THAT(data.header,
             ContainsSubstring("# particles = ") && ContainsSubstring("# spacing_m = 0.1"));
  for (char const* method : {"L-BFGS", "HOT", "PN-PCG", "DK block_jacobi"}) {
    CAPTURE(method);
    std::vector<Row> const rows = data.of(method);
    REQUIRE(rows.size() > 1);
    CHECK(number(rows.back(), "position_error") < 1e-6);
    CHECK(rows.front().at("energy_gap").empty());
    CHECK(number(rows.back(), "seconds") > 0);
  }
  // What a Newton method takes in few iterations, a nonlinear CG takes in many.
  CHECK(data.of("PN-PCG").size() < data.of("DK block_jacobi").size());
}

TEST_CASE("a sweep over a stiffness of particles", "[chart][mpm]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, bar);
  options.sweep = true;
  options.methods = {"lbfgs", "pn_pcg"};
  Data const data = chart(options);
  REQUIRE(data.rows.size() == 4);
  for (Row const& row : data.rows) {
    CAPTURE(row.at("method"), row.at("value"));
    CHECK(number(row, "position_error") <= options.target / 10);
    CHECK(number(row, "iterations") >= 1);
  }
}

TEST_CASE("a step of nodes begins at rest and is the same for all", "[chart][mpm]") {
  ScratchFolder const folder;
  auto const file = folder.write("bar.toml", bar);
  auto const scene = make_chart_scene(file, {});
  ReferenceStep const step = scene->advance_to(2);
  REQUIRE(step.start.size() == step.solution.size());
  // Nodes at rest lie on the lattice.
  for (Point const& x : step.start)
    for (double c : x) CHECK(std::abs(c / 0.1 - std::round(c / 0.1)) < 1e-9);
  auto const measure = scene->measure(step, {});
  CHECK(measure->position_error(step.solution) == 0);
  CHECK(measure->position_error(step.start) == 1);
  CHECK(measure->length() > 0);
  CHECK_THROWS_MATCHES(scene->advance_to(2), Error, MessageMatches(ContainsSubstring("ascending")));
}

TEST_CASE("totals run whole scenes, each method by its own rule", "[chart][mpm]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, bar);
  options.frames = {};
  options.totals = true;
  options.methods = {"lbfgs", "pn_pcg", "dk:preconditioner=block_jacobi:max_iterations=1"};
  Data const data = chart(options);
  REQUIRE(data.rows.size() == 3);
  for (Row const& row : data.rows) {
    CAPTURE(row.at("method"));
    bool const enough = row.at("method") != "DK block_jacobi max_iterations=1";
    CHECK(row.at("ended") == (enough ? "end of scene" : "not converged"));
    CHECK(number(row, "frames") == 3);
    CHECK((number(row, "error_m") < 1e-3) == enough);
    CHECK((number(row, "linear_iterations") > 0) == (row.at("method") == "PN-PCG"));
  }
  options.frames = {1};
  options.force = true;
  CHECK_THROWS_MATCHES(chart_command(options), Error,
                       MessageMatches(ContainsSubstring("time.frames=N")));
}

TEST_CASE("charts of particles refuse what is of meshes", "[chart][mpm]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, bar);
  auto const refused = [&](std::string const& part) {
    CHECK_THROWS_MATCHES(chart_command(options), Error, MessageMatches(ContainsSubstring(part)));
  };
  options.methods = {"hott"};
  refused("did you mean \"hot\"?");
  options.methods = {"lbfgs"};
  options.without_contact = true;
  refused("of material points");
  options.without_contact = false;
  options.methods = {};
  options.frames = {};
  options.stability = true;
  refused("which material points do not have");
}
