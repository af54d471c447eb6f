// Charts of scenes of material points: the nodes of the first step of the grid in a frame.
#include <taut/apps/chart/scene.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_exception.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include "chart_data.hpp"

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::MessageMatches;
using Catch::Matchers::WithinRel;

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

TEST_CASE("residuals are what HOT's rule stops by", "[chart][mpm]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, bar);
  options.methods = {"hot:stopping=characteristic_norm:tolerance=1e-8", "lbfgs"};
  options.residual = 1e-8;
  options.lowest = 1e-3;
  Data const data = chart(options);
  CHECK_THAT(data.header, ContainsSubstring("# residual = 1e-08\n"));
  std::vector<Row> const rows = data.of("HOT characteristic_norm tolerance=1e-8");
  REQUIRE(rows.size() > 2);
  CHECK(number(rows.back(), "residual") < 1e-8);
  for (std::size_t k = 0; k + 1 < rows.size(); ++k) CHECK(number(rows[k], "residual") >= 1e-8);
  // Another method goes on until both are small.
  Row const last = data.of("L-BFGS").back();
  CHECK(last.at("ended") == "accurate");
  CHECK(number(last, "residual") < 1e-8);
  CHECK(number(last, "position_error") <= 1e-3);
}

TEST_CASE("linear iterations of Newton are counted up to each of its own", "[chart][mpm]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, bar);
  options.methods = {"pn_pcg", "lbfgs"};
  options.linear = true;
  Data const data = chart(options);
  double before = 0;
  for (Row const& row : data.of("PN-PCG")) {
    CHECK(number(row, "linear_iterations") > before);
    before = number(row, "linear_iterations");
  }
  for (Row const& row : data.of("L-BFGS")) CHECK(row.at("linear_iterations").empty());
}

TEST_CASE("fields have the errors and residuals of an iteration point by point", "[chart][mpm]") {
  ScratchFolder const folder;
  ChartOptions options = options_for(folder, bar);
  options.methods = {"lbfgs"};
  options.fields = {0, 2, 1000};
  Data const data = chart(options), fields = read_data(options.out / "fields.csv");
  std::vector<Row> const start = fields.where("iteration", "0"),
                         second = fields.where("iteration", "2"),
                         end = fields.where("iteration", "1000");
  REQUIRE(start.size() > 100);
  REQUIRE(second.size() == start.size());
  REQUIRE(end.size() == start.size());
  auto const rms = [](std::vector<Row> const& rows, char const* column) {
    double sum = 0;
    for (Row const& row : rows) sum += number(row, column) * number(row, column);
    return std::sqrt(sum / static_cast<double>(rows.size()));
  };
  CHECK_THAT(rms(second, "residual"), WithinRel(number(data.rows[1], "residual"), 1e-4));
  // After its end, the end.
  CHECK_THAT(rms(end, "residual"), WithinRel(number(data.rows.back(), "residual"), 1e-4));
  CHECK(rms(second, "error") < rms(start, "error"));
  CHECK(rms(end, "error") < 1e-5);
  for (Row const& row : start) {
    double const cells = number(row, "x") / 0.1;
    CHECK(std::abs(cells - std::round(cells)) < 1e-4);
  }
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
    CHECK(number(row, "residual") < options.residual);
    CHECK(number(row, "residual_iterations") >= 1);
    CHECK(number(row, "residual_seconds") > 0);
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
  Data const frames = read_data(options.out / "frames.csv");
  for (Row const& row : data.rows) {
    std::vector<Row> const own = frames.where("method", row.at("method"));
    REQUIRE(own.size() == 3);
    for (char const* column : {"iterations", "linear_iterations", "grid_steps"}) {
      double sum = 0;
      for (Row const& frame : own) sum += number(frame, column);
      CHECK(sum == number(row, column));
    }
    CHECK(number(row, "grid_steps") >= 3);
  }
  options.force = true;
  options.relative = "hot";
  CHECK_THROWS_MATCHES(chart_command(options), Error,
                       MessageMatches(ContainsSubstring("none of the --methods")));
  options.relative = "lbfgs";
  CHECK_THAT(chart(options).header, ContainsSubstring("# relative_to = L-BFGS\n"));
  options.frames = {1};
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
