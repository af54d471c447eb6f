// A step as a chart sees it, with a minimiser whose iterates are known.
#include <taut/apps/chart/trace.hpp>
#include <taut/core/report/error.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include "scene_text.hpp"

using namespace taut;
using Catch::Matchers::WithinRel;

namespace {

/// After iteration k = 1, 2, ... all vertices are `errors[k - 1]` away from the solution.
class Scripted final : public Simulation {
public:
  std::vector<double> errors;
  Stop stop = Stop::stalled;
  bool throws = false;
  int runs = 0, copies = 0, linear = 0;
  std::vector<Point> solution;

  NewtonReport step(IterationObserver const& observer) override {
    ++runs;
    for (std::size_t k = 0; k < errors.size(); ++k) {
      observer({static_cast<int>(k), 0, 0, [&] {
                  ++copies;
                  std::vector<Point> x = solution;
                  for (Point& p : x) p[2] += errors[k];
                  return x;
                }});
    }
    if (throws) throw Error("the energy is not a number any more");
    NewtonReport report;
    report.stop = stop;
    report.linear_iterations = linear;
    return report;
  }
  double time() const override { return 0; }
  int steps() const override { return 0; }
  std::optional<ContactReport> contact() const override { return {}; }
  std::vector<Point> positions() const override { return solution; }
  std::vector<Point> velocities() const override { return {}; }
  void save(Checkpoint& checkpoint) const override {
    checkpoint.set("x", std::vector<float>{0, 0});
    checkpoint.set("steps", std::vector<std::int32_t>{0});
  }
  void restore(Checkpoint const& checkpoint) override { restored = checkpoint; }
  Checkpoint restored;
};

/// Residuals that are an error of position by a factor.
class Tenfold final : public StepMeasure {
public:
  explicit Tenfold(StepMeasure const& errors) : errors_(errors) {}
  double length() const override { return errors_.length(); }
  double position_error(std::vector<Point> const& x) const override {
    return errors_.position_error(x);
  }
  double energy_gap(std::vector<Point> const& x) const override { return errors_.energy_gap(x); }
  std::vector<double> errors(std::vector<Point> const& x) const override {
    return errors_.errors(x);
  }
  std::vector<double> residuals(std::vector<Point> const& x) const override {
    std::vector<double> all = errors_.errors(x);
    for (double& one : all) one *= 10;
    return all;
  }

private:
  StepMeasure const& errors_;
};

struct Stage {
  test::ScratchFolder folder;
  Scene scene = load_scene(folder.write("plain.toml", test::plain_scene));
  SceneGeometry geometry = build_geometry(scene);
  Scripted simulation;
  ReferenceStep reference;
  MeshMeasure measure;

  Stage() : reference(make_reference()), measure(make_measure()) {}
  ReferenceStep make_reference() {
    ReferenceStep made{};
    made.step = 3;
    made.before.set("x", std::vector<double>{0.1, 7});
    made.before.set("steps", std::vector<std::int32_t>{2});
    made.start = geometry.mesh.points;
    made.solution = geometry.mesh.points;
    for (Point& p : made.solution) p[0] += 0.25;
    simulation.solution = made.solution;
    return made;
  }
  MeshMeasure make_measure() const {
    return MeshMeasure(scene, geometry, 3, reference.start, reference.solution);
  }
};

}  // namespace

TEST_CASE("a trace records every iteration and times the same ones", "[chart]") {
  Stage s;
  s.simulation.errors = {0.2, 0.1, 0.002, 0.01, 0.0005};
  Trace const t = trace(s.simulation, s.reference, s.measure, {.lowest = 0, .repetitions = 2});
  REQUIRE(t.points.size() == 5);
  for (std::size_t k = 0; k < 5; ++k) {
    CHECK_THAT(t.points[k].position_error, WithinRel(s.simulation.errors[k] / 0.25, 1e-9));
    CHECK(t.points[k].energy_gap > 0);
    CHECK(t.points[k].seconds >= 0);
    if (k > 0) CHECK(t.points[k].seconds >= t.points[k - 1].seconds);
  }
  CHECK(t.ended == "stalled");
  CHECK(s.simulation.runs == 3);
  CHECK(s.simulation.copies == 5);  // positions are not looked at while the clock runs

  // The error rose above 1 % once more at iteration 4.
  CHECK(t.reached(0.01) == 5);
  CHECK(t.reached(0.5) == 2);
  CHECK(t.reached(2) == 1);
  CHECK_FALSE(t.reached(1e-3));
}

TEST_CASE("a trace that has residuals goes on until these are small, too", "[chart]") {
  Stage s;
  s.simulation.errors = {0.2, 0.01, 0.002, 0.003, 0.0005, 0.0001};
  CHECK(std::isnan(trace(s.simulation, s.reference, s.measure, {}).points[0].residual));
  Trace const t =
      trace(s.simulation, s.reference, Tenfold(s.measure), {.lowest = 0.05, .residual = 0.1});
  CHECK(t.ended == "accurate");
  REQUIRE(t.points.size() == 3);
  for (std::size_t k = 0; k < 3; ++k)
    CHECK_THAT(t.points[k].residual, WithinRel(10 * s.simulation.errors[k] / 0.25, 1e-9));
  CHECK(t.stopped_by(0.1) == 3);
  CHECK(t.stopped_by(0.5) == 2);
  CHECK(t.stopped_by(0.09) == 3);
  CHECK_FALSE(t.stopped_by(0.05));
}

TEST_CASE("points are kept of the iterations that were asked for", "[chart]") {
  Stage s;
  s.simulation.errors = {0.2, 0.1, 0.05};
  Trace const t = trace(s.simulation, s.reference, s.measure, {.keep = {0, 2, 9}});
  REQUIRE(t.kept.size() == 3);
  auto const off = [&](int k) { return s.measure.position_error(t.kept.at(k)); };
  CHECK(off(0) == 0);  // this simulation says that it starts at the solution
  CHECK_THAT(off(2), WithinRel(0.1 / 0.25, 1e-9));
  CHECK_THAT(off(9), WithinRel(0.05 / 0.25, 1e-9));
  CHECK(trace(s.simulation, s.reference, s.measure, {}).kept.empty());
}

TEST_CASE("linear iterations are counted by steps that end early", "[chart]") {
  Stage s;
  std::vector<int> asked;
  int each = 7;
  auto const limited = [&](int k) {
    asked.push_back(k);
    auto simulation = std::make_unique<Scripted>();
    simulation->linear = each * k;
    return simulation;
  };
  CHECK(linear_iterations(limited, s.reference, 3, 60) == std::vector<int>{7, 14, 21});
  CHECK(asked == std::vector<int>{1, 2, 3});
  each = 0;  // a method that solves none is not asked again
  CHECK(linear_iterations(limited, s.reference, 3, 60).empty());
  CHECK(asked.size() == 4);
}

TEST_CASE("the state is rounded to what a method keeps", "[chart]") {
  Stage s;
  s.simulation.errors = {0.1};
  trace(s.simulation, s.reference, s.measure, {});
  CHECK(s.simulation.restored.get<float>("x") == std::vector<float>{0.1f, 7});
  CHECK(s.simulation.restored.number<std::int32_t>("steps") == 2);
}

TEST_CASE("a trace says how it ended", "[chart]") {
  Stage s;
  s.simulation.errors = {0.2, 0.1, 0.001, 0.0001};
  SECTION("accurate enough") {
    Trace const t = trace(s.simulation, s.reference, s.measure, {.lowest = 0.005});
    CHECK(t.ended == "accurate");
    CHECK(t.points.size() == 3);
  }
  SECTION("out of iterations") {
    s.simulation.stop = Stop::budget_iterations;
    CHECK(trace(s.simulation, s.reference, s.measure, {}).ended == "budget");
  }
  SECTION("out of seconds") {
    Trace const t = trace(s.simulation, s.reference, s.measure, {.max_seconds = 0});
    CHECK(t.ended == "budget");
    CHECK(t.points.size() == 1);
  }
  SECTION("by its own rule") {
    s.simulation.stop = Stop::converged_by_energy_drop;
    CHECK(trace(s.simulation, s.reference, s.measure, {}).ended == "converged");
  }
  SECTION("not finite") {
    s.simulation.throws = true;
    Trace const t = trace(s.simulation, s.reference, s.measure, {});
    CHECK(t.ended == "not finite");
    CHECK(t.points.size() == 4);
  }
  SECTION("not finite at once") {
    s.simulation.throws = true;
    s.simulation.errors.clear();
    Trace const t = trace(s.simulation, s.reference, s.measure, {});
    CHECK(t.ended == "not finite");
    CHECK(t.points.empty());
    CHECK_FALSE(t.reached(1));
  }
}

TEST_CASE("energies are evaluated ever more rarely", "[chart]") {
  Stage s;
  for (int k = 0; k < 500; ++k) s.simulation.errors.push_back(1.0 / (k + 1));
  s.simulation.stop = Stop::budget_iterations;
  Trace const t = trace(s.simulation, s.reference, s.measure, {.repetitions = 0});
  int evaluated = 0;
  for (TracePoint const& p : t.points) evaluated += std::isfinite(p.energy_gap);
  CHECK(evaluated > 64);
  CHECK(evaluated < 200);
  for (int k = 0; k < 32; ++k) CHECK(std::isfinite(t.points[k].energy_gap));
}
