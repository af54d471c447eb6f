// Whole steps with every kernel: the default minimiser with its cycle, whose stencils are as wide
// as the kernel asks for, against another minimiser.
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>
#include <taut/mpm/particle_stepper.hpp>

#include <catch2/catch_template_test_macros.hpp>

#include <algorithm>

#include "cycle_on_kernel.hpp"
#include "particle_scenes.hpp"

namespace taut {
namespace {

using S = DefaultSpace;
using P = Fp64;

using Plain = Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, P>;

struct End {
  static constexpr double dx = 0.1;
  std::vector<Particle> particles;
  int iterations = 0;
};

/// A block that falls onto a floor which it sticks to.
template <Spline K, class Minimiser>
End drop(typename Minimiser::Params const& params) {
  using Solid = ElasticParticles<Elastic<FixedCorotated, FullProjection>, K, P>;
  constexpr double dx = End::dx, h = 0.01;
  std::vector<Particle> list = test::jittered_block(6, 2, dx, {-2.3, 0.7, 4.6});
  for (Particle& p : list) {
    p.F = identity3<double>();
    p.C = {};
    p.v = {0.5, -3, 0};
    p.stiffness = 1;
  }
  Particles<P, S> const particles(list);
  ParticleGrid<K, P> grid(dx);
  Potential scene(grid.unknowns(), Inertia<P>(grid.unknowns()),
                  BodyForce<P>(grid.unknowns(), {0, -9.81, 0}), Solid({lame_parameters(1e6, 0.3)}));
  BoundaryList<S> floor({{.name = "floor"}});
  ParticleStepper<ImplicitEuler<Minimiser>, K> stepper{ImplicitEuler<Minimiser>(params)};
  End end;
  for (int n = 0; n < 4; ++n) {
    auto const report = stepper.step(scene, grid, particles, h, floor, n * h);
    CHECK(report.minimiser.converged());
    CHECK(report.halvings == 0);
    end.iterations += report.minimiser.iterations;
  }
  end.particles = particles.read();
  return end;
}

TEMPLATE_TEST_CASE("every kernel composes with the cycle, and minimisers agree on its steps",
                   "[mpm][stepper]", LinearSpline, QuadraticSpline, CubicSpline) {
  End const cycle = drop<TestType, typename test::CycleOnKernel<TestType>::Minimiser>(
      {.lbfgs = {.newton_step = false}, .stop = {.tolerance = 1e-6}});
  End const plain = drop<TestType, Plain>({.stop = {.tolerance = 1e-6}});
  CAPTURE(cycle.iterations, plain.iterations);
  REQUIRE(cycle.particles.size() == plain.particles.size());
  double moved = 0, apart = 0, strained = 0;
  for (std::size_t p = 0; p < cycle.particles.size(); ++p) {
    Particle const &a = cycle.particles[p], &b = plain.particles[p];
    moved = std::max(moved, norm(a.v - Vec3<double>{0.5, -3, 0}));
    apart = std::max(apart, norm(a.x - b.x));
    Mat3<double> const strain = a.F - identity3<double>();
    strained = std::max(strained, contract(strain, strain));
  }
  CHECK(moved > 3);        // it has met the floor,
  CHECK(strained > 1e-3);  // is dented,
  CHECK(apart < 1e-5 * End::dx);
  CHECK(2 * cycle.iterations < plain.iterations);
}

}  // namespace
}  // namespace taut
