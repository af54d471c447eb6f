// Dynamic problems with known answers (F5, F12, F24), recovery from scrambled states, and the
// promise that neither threads, nor an interruption, nor the order of the mesh change the result.
#include "problem.hpp"

#include <support/threads.hpp>
#include <taut/core/math/polar.hpp>

#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <algorithm>
#include <numbers>
#include <numeric>
#include <random>

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
  for (auto const& o : of_solver(tight_newton(1e-9))) overrides.push_back(o);
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

/// Angular momentum about the centre of mass, kg m^2/s.
Vec3<double> spin(Trial const& trial, std::vector<double> const& mass) {
  auto const x = trial.simulation->positions(), v = trial.simulation->velocities();
  Vec3<double> centre{}, sum{};
  double total = 0;
  auto const vec = [](Point const& p) { return Vec3<double>{p[0], p[1], p[2]}; };
  for (std::size_t i = 0; i < x.size(); ++i) {
    centre = centre + mass[i] * vec(x[i]);
    total += mass[i];
  }
  centre = (1 / total) * centre;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sum = sum + mass[i] * cross(vec(x[i]) - centre, vec(v[i]));
  }
  return sum;
}

double kinetic_energy(std::vector<double> const& mass, std::vector<Point> const& v) {
  double sum = 0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    sum += 0.5 * mass[i] * (v[i][0] * v[i][0] + v[i][1] * v[i][1] + v[i][2] * v[i][2]);
  }
  return sum;
}

/// What remains between x and the rest shape after the best rigid motion: the largest distance, m.
double distance_to_rest(TetMesh const& rest, std::vector<Point> const& x) {
  double const n = double(x.size());
  Vec3<double> from{}, to{};
  auto const vec = [](Point const& p) { return Vec3<double>{p[0], p[1], p[2]}; };
  for (std::size_t i = 0; i < x.size(); ++i) {
    from = from + (1 / n) * vec(rest.points[i]);
    to = to + (1 / n) * vec(x[i]);
  }
  Mat3<double> moment{};
  for (std::size_t i = 0; i < x.size(); ++i) {
    moment = moment + outer(vec(x[i]) - to, vec(rest.points[i]) - from);
  }
  Mat3<double> const R = polar_rotation(moment);
  double worst = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    worst = std::max(worst, norm(vec(x[i]) - to - R * (vec(rest.points[i]) - from)));
  }
  return worst;
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

TEST_CASE("F12: the twisting column neither inverts nor gains energy", "[truth]") {
  // Through the time of the largest twist (a quarter of 4 L / c, 0.08 s with the shear wave's c) to
  // 0.1 s. Fixed corotated would let elements invert.
  struct Variant {
    char const* model;
    double poisson;
    char const* integrator;
  };
  for (auto const& [model, poisson, integrator] :
       {Variant{"neo_hookean", 0.3, "implicit_euler"},
        Variant{"neo_hookean", 0.495, "implicit_euler"},
        Variant{"fixed_corotated", 0.3, "implicit_euler"}, Variant{"neo_hookean", 0.3, "bdf2"}}) {
    INFO(model << ", nu = " << poisson << ", " << integrator);
    Trial trial("twisting_column",
                {fmt::format("time.integrator={}", integrator), "time.step=0.002", "time.frames=50",
                 fmt::format("object.column.material.poisson={}", poisson),
                 fmt::format("object.column.material.model={}", model)},
                true);
    auto const mass = masses(trial.geometry);
    double const start = kinetic_energy(mass, trial.geometry.velocity);
    double energy = start, elastic = 0, most_elastic = 0, most = 0, gained = -1;
    bool converged = true;
    std::size_t inverted = 0;
    for (int k = 0; k < 50; ++k) {
      converged = trial.simulation->step().converged() && converged;
      auto const x = trial.simulation->positions();
      inverted += inverted_tets(trial.geometry.mesh, x).size();
      elastic = elastic_energy(trial.geometry, x);
      most_elastic = std::max(most_elastic, elastic);
      double const now = kinetic_energy(mass, trial.simulation->velocities()) + elastic;
      gained = std::max(gained, now / energy - 1);
      most = std::max(most, now);
      energy = now;
    }
    INFO("energy left " << energy / start << ", elastic at most " << most_elastic / start
                        << ", largest gain in a step " << gained << ", most " << most / start);
    CHECK(converged);
    CHECK(inverted == 0);
    // Implicit Euler loses energy in every step; BDF2 loses less, but not in every single one.
    if (std::string(integrator) == "implicit_euler") CHECK(gained < 1e-12);
    CHECK(most < start);
    // It has twisted, and turns back: not all is lost to damping.
    CHECK(most_elastic > 0.4 * start);
    CHECK(elastic < 0.97 * most_elastic);
    CHECK(energy > 0.4 * start);
  }
}

TEST_CASE("F24: momentum of a free body", "[truth]") {
  // Linear momentum is that of a falling point. Angular momentum: a step of implicit Euler loses up
  // to (omega h)^2 of it, because x_{k+1} x v_{k+1} = (x_k + h v_{k+1}) x v_k; BDF2 loses far less,
  // and wins a little of it back while the body swells and shrinks.
  ScratchFolder const folder;
  double const spin_rate = 1200 * std::numbers::pi / 180, h = 0.01;  // rad/s
  std::string const text = replaced(
      replaced(plain_scene, "[[pin]]\nname = \"floor\"\nselect = { side = \"y_min\" }\n", ""),
      "density = 1000 }",
      "density = 1000 }\nvelocity = { axis = [0, 0, 1], angular_velocity = 1200 }");
  for (std::string const integrator : {"implicit_euler", "bdf2"}) {
    for (std::string const precision : {"fp64", "mixed"}) {
      INFO(integrator << ", " << precision);
      Trial trial(load_scene(folder.write("free.toml", text),
                             {false,
                              {"solver.tolerance=1e-6", "solver.precision=" + precision,
                               "time.integrator=" + integrator}}));
      auto const mass = masses(trial.geometry);
      double total = 0;
      for (double m : mass) total += m;
      double const scale = total * spin_rate;  // kg m/s
      double const round_off = precision == "fp64" ? 1e-12 : 1e-5;
      double const start = spin(trial, mass)[2], bound = spin_rate * h * spin_rate * h;
      double before = start;
      CHECK(start > 0.1 * scale);
      for (int k = 1; k <= 8; ++k) {
        trial.simulation->step();
        CHECK_THAT(momentum(trial, mass, 0), WithinAbs(0, round_off * scale));
        CHECK_THAT(momentum(trial, mass, 1), WithinAbs(-10 * h * k * total, round_off * scale));
        CHECK_THAT(momentum(trial, mass, 2), WithinAbs(0, round_off * scale));
        Vec3<double> const L = spin(trial, mass);
        INFO("step " << k << ": lost " << (1 - L[2] / before) << ", (omega h)^2 = " << bound);
        if (integrator == "bdf2") {
          CHECK_THAT(L[2] / before, WithinAbs(1, 0.25 * bound));
        } else {
          CHECK(L[2] < before);
          CHECK(L[2] > (1 - bound) * before);
        }
        CHECK_THAT(L[0], WithinAbs(0, round_off * scale));
        CHECK_THAT(L[1], WithinAbs(0, round_off * scale));
        before = L[2];
      }
      double const lost = 1 - before / start;
      INFO("lost in all: " << lost);
      CHECK(lost > 0);
      CHECK(lost < (integrator == "bdf2" ? 0.03 : 0.2));
    }
  }
}

TEST_CASE("F24: the order in which angular momentum is kept", "[truth]") {
  // A stiff free body that turns by 0.8 rad: implicit Euler loses (omega h)^2 in each step, which
  // is of first order in h over a given time.
  ScratchFolder const folder;
  double const rate = 10, end = 0.08;  // rad/s, s
  std::string text = replaced(
      replaced(plain_scene, "[[pin]]\nname = \"floor\"\nselect = { side = \"y_min\" }\n", ""),
      "young = 1e5, poisson = 0.4, density = 1000 }",
      "young = 1e8, poisson = 0.4, density = 1000 }\nvelocity = { axis = [0, 0, 1], "
      "angular_velocity = 572.957795130823 }");
  for (auto const& [integrator, order] :
       {std::pair{"implicit_euler", 1.0}, std::pair{"bdf2", 2.0}}) {
    double lost[2];
    for (int k = 0; k < 2; ++k) {
      int const steps = 16 << k;
      Trial trial(load_scene(
          folder.write("free.toml", text),
          {false,
           {"gravity=[0, 0, 0]", "solver.tolerance=1e-7", fmt::format("time.step={}", end / steps),
            fmt::format("time.integrator={}", integrator)}}));
      auto const mass = masses(trial.geometry);
      double const start = spin(trial, mass)[2];
      after(trial, steps);
      lost[k] = 1 - spin(trial, mass)[2] / start;
      UNSCOPED_INFO(integrator << ", " << steps << " steps: lost " << lost[k]);
    }
    CHECK(lost[1] > 0);
    CHECK_THAT(std::log2(lost[0] / lost[1]), WithinAbs(order, 0.3));
    if (order == 1) CHECK_THAT(lost[1], WithinRel(rate * rate * end * end / 32, 0.2));
  }
}

TEST_CASE("a scrambled body finds its shape again", "[truth]") {
  std::vector<std::pair<std::string, std::vector<std::string>>> const bodies{
      {"scrambled_flat", {}},
      {"scrambled_random", {}},
      {"scrambled_random", {"object.body.start.seed=2", "object.body.shape.resolution=5"}},
      {"scrambled_random", {"object.body.start.seed=3", "object.body.shape.resolution=5"}}};
  for (auto const& [name, overrides] : bodies) {
    INFO(name << (overrides.empty() ? "" : ", " + overrides[0]));
    Trial trial(name, overrides);
    TetMesh const& mesh = trial.geometry.mesh;
    auto const before = inverted_tets(mesh, trial.geometry.start).size();
    CHECK(before > mesh.tets.size() / 4);
    CHECK(distance_to_rest(mesh, trial.geometry.start) > 0.2);
    bool converged = true;
    for (int k = 0; k < trial.scene.frames; ++k) {
      converged = trial.simulation->step().converged() && converged;
    }
    CHECK(converged);
    auto const x = trial.simulation->positions();
    CHECK(inverted_tets(mesh, x).empty());
    CHECK(distance_to_rest(mesh, x) < 2e-3);  // bodies of one metre; what is left are vibrations
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

TEST_CASE("the order of a mesh's vertices and tets is invisible", "[truth]") {
  // Sums take another order inside, so that round-off alone differs.
  for (char const* name : {"drag", "bimaterial"}) {
    INFO(name);
    Trial plain(name, {}, true), mixed(name, {}, true);
    std::mt19937 rng(4);
    SceneGeometry& g = mixed.geometry;
    std::vector<std::int32_t> to(g.mesh.points.size()), tets(g.mesh.tets.size());
    std::iota(to.begin(), to.end(), 0);
    std::iota(tets.begin(), tets.end(), 0);
    std::shuffle(to.begin(), to.end(), rng);
    std::shuffle(tets.begin(), tets.end(), rng);
    SceneGeometry const& from = plain.geometry;
    for (std::size_t v = 0; v < to.size(); ++v) {
      g.mesh.points[to[v]] = from.mesh.points[v];
      g.start[to[v]] = from.start[v];
      g.velocity[to[v]] = from.velocity[v];
    }
    for (std::size_t t = 0; t < tets.size(); ++t) {
      Tet const& tet = from.mesh.tets[t];
      g.mesh.tets[tets[t]] = {to[tet[1]], to[tet[2]], to[tet[0]], to[tet[3]]};
      g.material_of_tet[tets[t]] = from.material_of_tet[t];
      g.object_of_tet[tets[t]] = from.object_of_tet[t];
    }
    for (Pin& pin : g.pins) {
      for (std::int32_t& v : pin.vertices) v = to[v];
      std::sort(pin.vertices.begin(), pin.vertices.end());
    }
    for (Force& force : g.forces) {
      REQUIRE(force.force.empty());  // or their order must follow
      for (std::int32_t& v : force.vertices) v = to[v];
      std::sort(force.vertices.begin(), force.vertices.end());
    }
    mixed.reset();
    auto const x = after(plain, 3), y = after(mixed, 3);
    double worst = 0, moved = 0;
    for (std::size_t v = 0; v < to.size(); ++v) {
      for (int c = 0; c < 3; ++c) {
        worst = std::max(worst, std::abs(x[v][c] - y[to[v]][c]));
        moved = std::max(moved, std::abs(x[v][c] - from.mesh.points[v][c]));
      }
    }
    CHECK(moved > 1e-3);
    CHECK(worst < 1e-9);
  }
}
