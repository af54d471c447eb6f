// Dynamic problems with known answers (F5, F12, F24), recovery from scrambled states, and the
// promise that neither threads nor an interruption change a bit.
#include "problem.hpp"

#include <support/threads.hpp>

#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <numbers>

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// F5: a bar that is fixed at its top and swings along itself in its first mode,
/// u = (v0 / omega) sin(omega t) sin(beta s); displacement of the tip after each step.
std::vector<double> vibrating_bar(std::string const& integrator, double h, int steps) {
  std::vector<std::string> overrides{
      "time.integrator=" + integrator, fmt::format("time.step={}", h),
      fmt::format("time.frames={}", steps), "gravity=[0, 0, 0]", "object.bar.shape.resolution=10"};
  for (auto const& o : tight_newton(1e-9)) overrides.push_back("solver." + o);
  Trial trial("hanging_bar", overrides);
  double const beta = std::numbers::pi / 2, v0 = 1e-3;
  for (std::size_t i = 0; i < trial.geometry.velocity.size(); ++i) {
    double const s = 0.5 - trial.geometry.mesh.points[i][1];
    trial.geometry.velocity[i] = {0, -v0 * std::sin(beta * s), 0};
  }
  trial.reset();
  std::vector<double> tip;
  for (int k = 0; k < steps; ++k) {
    trial.simulation->step();
    auto const x = trial.simulation->positions();
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      Point const& X = trial.geometry.mesh.points[i];
      if (X[1] > -0.5 + 1e-9) continue;
      sum += X[1] - x[i][1];
      ++count;
    }
    tip.push_back(sum / count / v0);
  }
  return tip;
}

double const omega = std::numbers::pi / 2 * std::sqrt(1e5 / 1000);

double momentum(Trial const& trial, std::vector<double> const& mass, int axis) {
  auto const v = trial.simulation->velocities();
  double sum = 0;
  for (std::size_t i = 0; i < v.size(); ++i) sum += mass[i] * v[i][axis];
  return sum;
}

std::vector<double> masses(Trial const& trial) {
  std::vector<double> density;
  for (int m : trial.geometry.material_of_tet) {
    density.push_back(trial.geometry.materials[m].density);
  }
  return lumped_mass(trial.geometry.mesh, density);
}

std::vector<Point> after(Trial& trial, int steps) {
  for (int k = 0; k < steps; ++k) trial.simulation->step();
  return trial.simulation->positions();
}

}  // namespace

TEST_CASE("F5: implicit Euler damps an oscillation as it must", "[truth]") {
  // Per step the amplitude falls by (1 + (omega h)^2)^(-1/2), the phase advances by atan(omega h).
  int const steps = 15;
  double const period = 2 * std::numbers::pi / omega, h = period / 50;
  auto const tip = vibrating_bar("implicit_euler", h, steps);
  double const decay = 1 / std::sqrt(1 + omega * h * omega * h), phase = std::atan(omega * h);
  for (int k = 0; k < steps; ++k) {
    // x_k of x_{k+1} - 2 x_k + x_{k-1} = -(omega h)^2 x_{k+1} with x_0 = 0 and v_0 = 1.
    double const exact = std::pow(decay, k + 1) * std::sin((k + 1) * phase) / omega;
    CHECK_THAT(tip[k], WithinAbs(exact, 0.015 / omega));
  }
}

TEST_CASE("F5: orders of the time integrators", "[truth]") {
  // Against the same bar with a step four times smaller than the smallest, at a sixth of a period.
  double const end = 2 * std::numbers::pi / omega / 6;
  for (auto const& [name, order] : {std::pair{"implicit_euler", 1.0}, std::pair{"bdf2", 2.0}}) {
    double const exact = vibrating_bar("bdf2", end / 64, 64).back();
    double const coarse = vibrating_bar(name, end / 8, 8).back() - exact;
    double const fine = vibrating_bar(name, end / 16, 16).back() - exact;
    INFO(name);
    CHECK_THAT(std::log2(std::abs(coarse / fine)), WithinAbs(order, 0.3));
  }
}

TEST_CASE("F12: the twisting column neither inverts nor blows up", "[truth]") {
  Trial trial("twisting_column", {"solver.precision=fp64"}, true);
  auto const mass = masses(trial);
  double start = 0;
  for (std::size_t i = 0; i < mass.size(); ++i) {
    Point const& v = trial.geometry.velocity[i];
    start += 0.5 * mass[i] * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  }
  for (int k = 0; k < 8; ++k) {
    CHECK(trial.simulation->step().converged());
    CHECK(inverted_tets(trial.geometry.mesh, trial.simulation->positions()).empty());
    auto const v = trial.simulation->velocities();
    double kinetic = 0;
    for (std::size_t i = 0; i < mass.size(); ++i) {
      kinetic += 0.5 * mass[i] * (v[i][0] * v[i][0] + v[i][1] * v[i][1] + v[i][2] * v[i][2]);
    }
    CHECK(kinetic < 1.001 * start);
  }
}

TEST_CASE("F24: linear momentum of a free body is that of a falling point", "[truth]") {
  ScratchFolder const folder;
  std::string const text = replaced(
      replaced(plain_scene, "[[pin]]\nname = \"floor\"\nselect = { side = \"y_min\" }\n", ""),
      "density = 1000 }",
      "density = 1000 }\nvelocity = { axis = [0, 0, 1], angular_velocity = 20 }");
  for (std::string const precision : {"fp64", "mixed"}) {
    Trial trial(load_scene(folder.write("free.toml", text),
                           {false, {"solver.tolerance=1e-5", "solver.precision=" + precision}}));
    auto const mass = masses(trial);
    double total = 0;
    for (double m : mass) total += m;
    double const scale = total * 20;  // kg m/s
    for (int k = 1; k <= 4; ++k) {
      trial.simulation->step();
      double const tolerance = precision == "fp64" ? 1e-12 : 1e-5;
      CHECK_THAT(momentum(trial, mass, 0), WithinAbs(0, tolerance * scale));
      CHECK_THAT(momentum(trial, mass, 1), WithinAbs(-10 * 0.01 * k * total, tolerance * scale));
    }
  }
}

TEST_CASE("a scrambled body finds its shape again", "[truth]") {
  for (char const* name : {"scrambled_flat", "scrambled_random"}) {
    INFO(name);
    Trial trial(name, {"object.body.shape.depth=0.25", "time.step=0.04"});
    auto const before = inverted_tets(trial.geometry.mesh, trial.geometry.start).size();
    CHECK(before > trial.geometry.mesh.tets.size() / 4);
    auto const x = after(trial, 60);
    CHECK(inverted_tets(trial.geometry.mesh, x).empty());
    // Edges have their rest lengths again.
    double worst = 0;
    for (Tet const& tet : trial.geometry.mesh.tets) {
      for (int a = 1; a < 4; ++a) {
        auto const length = [&](std::vector<Point> const& p) {
          return std::hypot(p[tet[a]][0] - p[tet[0]][0], p[tet[a]][1] - p[tet[0]][1],
                            p[tet[a]][2] - p[tet[0]][2]);
        };
        worst = std::max(worst, std::abs(length(x) / length(trial.geometry.mesh.points) - 1));
      }
    }
    CHECK(worst < 0.1);
  }
}

TEST_CASE("a large prescribed motion in one step converges", "[truth]") {
  // The top of a block of 6 cells goes down by more than a cell and turns by 45 degrees in one
  // step.
  ScratchFolder const folder;
  std::string const text = replaced(plain_scene, "resolution = 2", "resolution = 6") +
                           "[[pin]]\nname = \"top\"\nselect = { side = \"y_max\" }\n"
                           "[[pin.motion]]\nend = 0.01\nvelocity = [0, -20, 0]\n"
                           "axis = [0, 1, 0]\ncentre = [0, 0.5, 0]\nangular_velocity = 4500\n";
  for (char const* model : {"stable_neo_hookean", "neo_hookean"}) {
    INFO(model);
    Trial trial(load_scene(
        folder.write("push.toml", text),
        {false,
         {fmt::format("object.cube.material.model={}", model), "object.cube.material.young=1e7"}}));
    auto const report = trial.simulation->step();
    CHECK(report.converged());
    CHECK(inverted_tets(trial.geometry.mesh, trial.simulation->positions()).empty());
    // The pins have arrived.
    RigidMap const map = trial.geometry.pins[1].motion.at(0.01);
    auto const x = trial.simulation->positions();
    double worst = 0;
    for (int v : trial.geometry.pins[1].vertices) {
      Point const to = map(trial.geometry.mesh.points[v]);
      for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(x[v][c] - to[c]));
    }
    CHECK(worst < 1e-6);
  }
}

TEST_CASE("results do not depend on the number of threads, bitwise", "[truth]") {
  for (std::string const precision : {"fp64", "mixed", "fp32"}) {
    INFO(precision);
    auto const results = on_one_thread_and_all([&] {
      Trial trial("drag", {"solver.precision=" + precision}, true);
      return after(trial, 5);
    });
    CHECK(results[0] == results[1]);
  }
}

TEST_CASE("a restarted run goes on bitwise", "[truth]") {
  for (std::string const integrator : {"implicit_euler", "bdf2"}) {
    std::vector<std::string> const overrides{"time.integrator=" + integrator,
                                             "solver.preconditioner=schwarz_32"};
    Trial whole("drag", overrides, true);
    auto const expected = after(whole, 6);
    Trial first("drag", overrides, true), second("drag", overrides, true);
    after(first, 3);
    Checkpoint checkpoint;
    first.simulation->save(checkpoint);
    second.simulation->restore(checkpoint);
    CHECK(after(second, 3) == expected);
    CHECK(second.simulation->velocities() == whole.simulation->velocities());
  }
}
