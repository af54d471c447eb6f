// Material points: a ball is thrown against a wall that it slides along.
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>
#include <taut/mpm/ghost_penalty.hpp>
#include <taut/mpm/particle_stepper.hpp>
#include <taut/mpm/sampling.hpp>
#include <taut/mpm/slip.hpp>

#include <cstdio>

int main() {
  Kokkos::ScopeGuard const kokkos;
  using namespace taut;
  double const dx = 0.04;
  RigidPose const start{identity3<double>(), {0.3, 0.15, 0}};
  ParticleBody const ball{.name = "ball",
                          .solid = placed(solid_ball(0.1), start),
                          .density = 1000,
                          .velocity = {-2, 0, 0}};
  Particles<> const particles(sample({&ball, 1}, dx));

  using Solid = ElasticParticles<Elastic<FixedCorotated, FullProjection>>;
  ParticleGrid<> grid(dx);
  Potential scene(grid.unknowns(), Inertia(grid.unknowns()),
                  BodyForce(grid.unknowns(), {0, -9.81, 0}), Solid({lame_parameters(1e5, 0.3)}),
                  GhostPenalty<>(), Slip<>());
  // Its frame's y axis points out of the solid: to the right.
  BoundaryList<DefaultSpace> walls(
      {{.name = "floor", .contact = BoundaryContact::separate},
       {.name = "wall",
        .contact = BoundaryContact::separate,
        .motion = at_rest({turn_matrix({{0, 0, 1}, -1.5707963267948966}), {0, 0, 0}})}});

  // Passes: what is to be held by a wall that separates is found by minimising.
  using Euler = ImplicitEuler<Ncg<DaiKou, BlockJacobi>>;
  ParticleStepper<Euler> stepper(Euler({}, {.passes = 8}));
  double time = 0;
  while (time < 0.3) {
    double const h = stepper.cfl_step(particles, dx, 0.01);
    auto const report = stepper.step(scene, grid, particles, h, walls, time);
    if (!report.minimiser.converged()) return 1;
    time += report.time_step;
  }
  double speed = 0, leftmost = 1;
  auto const end = particles.read();
  for (Particle const& p : end) {
    speed += p.v[0] / double(end.size());
    leftmost = std::min(leftmost, p.x[0]);
  }
  std::printf("%d particles fly back at %.2f m/s; the leftmost is at %.3f m\n", particles.count,
              speed, leftmost);
  return speed > 0.3 && leftmost > 0 ? 0 : 1;
}
