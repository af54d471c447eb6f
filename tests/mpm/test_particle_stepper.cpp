// Whole steps of the material point method: motions with known answers, what is conserved, and
// what happens to steps that cannot be taken.
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>
#include <taut/mpm/particle_stepper.hpp>

#include "particle_scenes.hpp"

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>
#include <support/threads.hpp>

#include <cmath>

namespace taut {
namespace {

using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using S = DefaultSpace;
using P = Mixed;
using Solid = ElasticParticles<Elastic<FixedCorotated, FullProjection>>;
using Minimiser = Ncg<DaiKou, BlockJacobi>;
using Stepper = ParticleStepper<ImplicitEuler<Minimiser>>;

/// All that a run needs.
struct Run {
  double dx;
  Particles<P, S> particles;
  ParticleGrid<> grid;
  Potential<Inertia<>, BodyForce<>, Solid> scene;
  Stepper stepper;

  Run(std::vector<Particle> const& list, double spacing, std::vector<Lame<double>> const& materials,
      Vec3<double> const& gravity = {0, 0, 0}, double tolerance = 1e-5)
      : dx(spacing),
        particles(list),
        grid(spacing),
        scene(grid.unknowns(), Inertia<>(grid.unknowns()), BodyForce<>(grid.unknowns(), gravity),
              Solid(materials)),
        stepper(ImplicitEuler<Minimiser>({.stop = {.tolerance = tolerance}})) {}
  auto step(double h) { return stepper.step(scene, grid, particles, h); }
};

std::vector<Particle> at_ease(std::vector<Particle> list) {
  for (Particle& p : list) {
    p.F = identity3<double>();
    p.C = 0.0 * identity3<double>();
    p.v = {};
    p.stiffness = 1;
  }
  return list;
}
double kinetic(std::vector<Particle> const& list, double dx) {
  double sum = 0;
  for (Particle const& p : list) {
    sum += 0.5 * p.mass * (dot(p.v, p.v) + 0.25 * dx * dx * contract(p.C, p.C));
  }
  return sum;
}
double elastic(std::vector<Particle> const& list, std::vector<Lame<double>> const& materials) {
  double sum = 0;
  for (Particle const& p : list) {
    sum += p.volume * p.stiffness * Elastic<FixedCorotated>::energy(materials[p.material], p.F);
  }
  return sum;
}
Vec3<double> momentum(std::vector<Particle> const& list) {
  Vec3<double> sum{};
  for (Particle const& p : list) sum = sum + p.mass * p.v;
  return sum;
}

TEST_CASE("a body in free fall keeps its shape", "[mpm][stepper]") {
  auto const list = at_ease(test::jittered_block(3, 2, 0.1, {-2.3, 5.2, 6.6}));
  Run run(list, 0.1, {lame_parameters(1e5, 0.3)}, {0, -10, 0});
  double const h = 0.01;
  for (int n = 1; n <= 20; ++n) {
    auto const report = run.step(h);
    CHECK(report.minimiser.converged());
    CHECK(report.halvings == 0);
    CHECK(report.time_step == h);
  }
  auto const end = run.particles.read();
  for (std::size_t p = 0; p < list.size(); ++p) {
    CHECK_THAT(norm(end[p].v - Vec3<double>{0, -2, 0}), WithinAbs(0, 1e-5));
    // h^2 g (1 + 2 + ... + 20)
    CHECK_THAT(norm(end[p].x - list[p].x - Vec3<double>{0, -0.21, 0}), WithinAbs(0, 1e-6));
    Mat3<double> const strain = end[p].F - identity3<double>();
    CHECK_THAT(contract(strain, strain), WithinAbs(0, 1e-10));
  }
}

TEST_CASE("a stretched body swings, loses energy only to the time step, and keeps its momentum",
          "[mpm][stepper]") {
  std::vector<Lame<double>> const materials{lame_parameters(1e4, 0.3)};
  auto list = at_ease(test::jittered_block(4, 2, 0.1, {0.3, 0.2, -0.6}));
  for (Particle& p : list) {
    p.F = {{1.2, 0, 0, 0, 0.95, 0, 0, 0, 0.95}};
    p.v = {0.3, -0.2, 0.1};
  }
  auto const lost = [&](double h) {
    Run run(list, 0.1, materials);
    double const start = kinetic(list, 0.1) + elastic(list, materials);
    double before = start, least_elastic = elastic(list, materials);
    for (double t = 0; t < 0.099; t += h) {
      CHECK(run.step(h).minimiser.converged());
      auto const now = run.particles.read();
      double const energy = kinetic(now, 0.1) + elastic(now, materials);
      CHECK(energy < before + 1e-4 * start);
      CHECK_THAT(norm(momentum(now) - momentum(list)), WithinAbs(0, 1e-4 * norm(momentum(list))));
      least_elastic = std::min(least_elastic, elastic(now, materials));
      before = energy;
    }
    CHECK(least_elastic < 0.4 * elastic(list, materials));
    return (start - before) / start;
  };
  double const coarse = lost(0.01), fine = lost(0.0025);
  CHECK(coarse > 0);
  CHECK(fine > 0);
  CHECK(fine < 0.75 * coarse);
}

/// Two discs a cell or two thick that fly at each other along the diagonal (F15).
std::vector<Particle> discs(double dx) {
  std::vector<Particle> list;
  double const r = 0.2, spacing = dx / 2;
  for (int disc = 0; disc < 2; ++disc) {
    double const centre = disc ? 0.71 : 0.29;
    for (int i = -20; i <= 20; ++i)
      for (int j = -20; j <= 20; ++j)
        for (int k = 0; k < 2; ++k) {
          double const x = (i + 0.5) * spacing, y = (j + 0.5) * spacing;
          if (x * x + y * y > r * r) continue;
          Particle p;
          p.x = {centre + x, centre + y, (k + 0.5) * spacing};
          p.v = (disc ? -0.1 : 0.1) * Vec3<double>{1, 1, 0};
          p.volume = spacing * spacing * spacing;
          p.mass = 1000 * p.volume;
          p.object = disc;
          list.push_back(p);
        }
  }
  return list;
}

TEST_CASE("discs collide and part", "[mpm][stepper]") {
  double const dx = 0.05;
  std::vector<Lame<double>> const materials{lame_parameters(1000, 0.3)};
  auto const list = discs(dx);
  Run run(list, dx, materials, {0, 0, 0}, 1e-4);
  double const start = kinetic(list, dx);
  double least = start, most_elastic = 0;
  auto const approach = [](std::vector<Particle> const& all) {
    double speed[2] = {}, mass[2] = {};
    for (Particle const& p : all) {
      speed[p.object] += p.mass * (p.v[0] + p.v[1]);
      mass[p.object] += p.mass;
    }
    return speed[0] / mass[0] - speed[1] / mass[1];
  };
  double const closing = approach(list);
  int converged = 0, steps = 0;
  for (double t = 0; t < 3; t += 0.05, ++steps) {
    converged += run.step(0.05).minimiser.converged();
    auto const now = run.particles.read();
    least = std::min(least, kinetic(now, dx));
    most_elastic = std::max(most_elastic, elastic(now, materials));
    CHECK(kinetic(now, dx) + elastic(now, materials) < 1.001 * start);
    CHECK_THAT(norm(momentum(now)), WithinAbs(0, 1e-5 * list.size() * list[0].mass * 0.14));
  }
  CHECK(converged == steps);
  CHECK(least < 0.5 * start);
  CHECK(most_elastic > 0.2 * start);
  double const parting = -approach(run.particles.read()) / closing;
  CHECK(parting > 0.3);
  CHECK(parting < 1);
  // They are apart: the one is left of and below the other.
  for (Particle const& p : run.particles.read()) {
    CHECK((p.x[0] + p.x[1] < 1) == (p.object == 0));
  }
}

TEST_CASE("steps of particles do not depend on the number of threads", "[mpm][stepper]") {
  auto const list = test::jittered_block(5, 2, 0.1, {-2.3, 5.2, 6.6}, 2);
  auto const runs = test::on_one_thread_and_all([&] {
    Run run(list, 0.1, {lame_parameters(1e4, 0.3), lame_parameters(1e6, 0.4)}, {0, -10, 0}, 1e-3);
    for (int n = 0; n < 3; ++n) run.step(0.01);
    return run.particles.read();
  });
  for (std::size_t p = 0; p < list.size(); ++p)
    for (int c = 0; c < 9; ++c) {
      REQUIRE(runs[0][p].F.a[c] == runs[1][p].F.a[c]);
      REQUIRE(runs[0][p].C.a[c] == runs[1][p].C.a[c]);
      REQUIRE(runs[0][p].x[c % 3] == runs[1][p].x[c % 3]);
    }
}

TEST_CASE("a step in which a particle goes too far is halved", "[mpm][stepper]") {
  auto list = at_ease(test::jittered_block(2, 2, 0.1, {0, 0, 0}));
  for (Particle& p : list) p.v = {3, 0, 0};
  Run run(list, 0.1, {lame_parameters(1e4, 0.3)});
  CHECK_THAT(run.stepper.cfl_step(run.particles, 0.1, 1.0), WithinRel(0.02, 1e-12));
  CHECK(run.stepper.cfl_step(run.particles, 0.1, 0.01) == 0.01);
  auto const report = run.step(0.1);  // 3 cells
  CHECK(report.halvings == 2);
  CHECK_THAT(report.time_step, WithinAbs(0.025, 1e-15));
  CHECK_THAT(report.travel_cells, WithinRel(0.75, 1e-5));
  CHECK_THAT(run.particles.read()[3].x[0] - list[3].x[0], WithinRel(0.075, 1e-6));
  // Without a way out the particles stay as they were.
  auto const before = run.particles.read();
  CHECK_THROWS_WITH(run.step(1e4), ContainsSubstring("was halved 10 times"));
  for (std::size_t p = 0; p < list.size(); ++p) {
    CHECK(norm(run.particles.read()[p].x - before[p].x) == 0);
  }
  CHECK_THROWS_WITH(run.step(0), ContainsSubstring("a step of 0 s"));
  run.particles.v(7, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(run.step(0.01), ContainsSubstring("particle 7: its velocity"));
  CHECK(run.stepper.cfl_step(run.particles, 0.1, 0.01) == 0.01);
}

int allocations = 0;
void count(Kokkos_Profiling_SpaceHandle, char const* name, void const*, std::uint64_t) {
  ++allocations;
  UNSCOPED_INFO(name);
}

TEST_CASE("steps allocate nothing once there have been as many nodes", "[mpm][stepper]") {
  // A body that drifts from leaf to leaf: after eight cells it has met all ways to lie in them.
  auto list = at_ease(test::jittered_block(4, 2, 0.1, {0.3, 0.3, 0.3}));
  for (Particle& p : list) p.v = {1, 1, 1};
  Run run(list, 0.1, {lame_parameters(1e4, 0.3)});
  int least = 1 << 30, most = 0, fewer = 0;
  for (int n = 0; n < 50; ++n) {
    if (n == 32) Kokkos::Tools::Experimental::set_allocate_data_callback(count);
    auto const report = run.step(0.03);
    fewer += n >= 32 && report.nodes < most;
    least = std::min(least, report.nodes);
    most = std::max(most, report.nodes);
  }
  Kokkos::Tools::Experimental::set_allocate_data_callback(nullptr);
  CHECK(allocations == 0);
  CHECK(most > least + 50);  // the number did change
  CHECK(fewer > 0);
}

}  // namespace
}  // namespace taut
