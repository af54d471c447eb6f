// Particles that yield within a step: the term against plain loops, its derivatives, what lags, and
// steps in which a body flows.
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/hencky.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/particle_stepper.hpp>
#include <taut/mpm/plastic_flow.hpp>

#include "particle_problem.hpp"

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

namespace taut {
namespace test {

/// A metal that half of the strained block yields by, and sand.
template <>
std::vector<HenckyParameters<double>> two_materials<Hencky>() {
  Lame<double> const metal{1e5, 1.5e5}, sand{3e4, 1e5};
  return {hencky(metal, VonMises{metal.mu, 1.2e4, 4e4}),
          hencky(sand, DruckerPrager{sand.mu, sand.lambda, 30})};
}

}  // namespace test
namespace {

using namespace test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using S = DefaultSpace;

template <class Kernel_, class Space_, bool packed_>
struct Yielding {
  using Material = Hencky;
  using Kernel = Kernel_;
  using Precision = Fp64;
  using Space = Space_;
  static constexpr bool packed = packed_;
  using Term = ElasticParticles<Material, Kernel, Precision, Space, packed>;
};

TEST_CASE("sweeps over particles that yield are the sums over all nodes", "[mpm][yielding]") {
  check_sweeps<Yielding<QuadraticSpline, RightOf<S>, true>>();
}

TEST_CASE("teams sweep over particles that yield as packs do", "[mpm][yielding]") {
  check_sweeps<Yielding<QuadraticSpline, LeftOf<S>, false>>();
}

TEST_CASE("value, gradient and product of particles that yield are derivatives of each other",
          "[mpm][yielding]") {
  Problem<Yielding<QuadraticSpline, RightOf<S>, true>> problem(1, 3);
  auto const& term = problem.term;
  using Term = std::decay_t<decltype(term)>;
  int const n = problem.scene.nodes();
  int flowing = 0, resting = 0;
  auto const u = problem.oracle.displacements(problem.x_host);
  for (Particle const& p : problem.list) {
    bool const flows = problem.oracle.state(p, u).over > 0;
    flowing += flows;
    resting += !flows;
  }
  CHECK(flowing > 30);
  CHECK(resting > 20);
  auto const at = [&](double t) {
    Field moved(problem.x_host);
    for (int i = 0; i < n; ++i) moved[i] = moved[i] + t * problem.p_host[i];
    return field_of<Term::Positions>(moved);
  };
  auto const gradient = [&](double t) {
    Term::Vectors const g("g", n);
    term.add_gradient(at(t), 1, problem.fixed, g);
    return read(g);
  };
  double const h = 1e-4;
  Field const g = gradient(0), up = gradient(h), down = gradient(-h);
  double slope = 0, curvature = 0, form = 0;
  for (int i = 0; i < n; ++i) slope += dot(g[i], problem.p_host[i]);
  CHECK_THAT((term.value(at(h), 1) - term.value(at(-h), 1)) / (2 * h), WithinRel(slope, 1e-6));
  CHECK_THAT(term.change(at(-h), problem.p, 2 * h, 1) / (2 * h), WithinRel(slope, 1e-6));
  Term::Vectors const hp("hp", n);
  term.add_product(problem.x, problem.p, 1, problem.fixed, hp);
  Field const product = read(hp);
  for (int i = 0; i < n; ++i) {
    curvature += dot(up[i] - down[i], problem.p_host[i]) / (2 * h);
    form += dot(product[i], problem.p_host[i]);
  }
  CHECK(form >= curvature * (1 - 1e-3));  // projected; some yield on the way
  CHECK(curvature > 0.5 * form);
  // The matrix is that of the product.
  std::vector<Connectivity> kinds;
  term.elements(kinds);
  Term::Matrix const matrix(pattern_from_elements(n, kinds));
  term.add_to(matrix, problem.x, 1, problem.fixed);
  auto const host = host_copy(matrix);
  Field by_matrix(n, Vec3<double>{});
  for (int i = 0; i < n; ++i)
    for (int k = host.row_begin(i); k < host.row_begin(i + 1); ++k) {
      by_matrix[i] = by_matrix[i] + host.block(k) * problem.p_host[host.column(k)];
    }
  CHECK(difference(by_matrix, product) < 1e-11 * largest(product));
}

TEST_CASE("the radius at which sand yields is that where the last minimisation ended",
          "[mpm][yielding]") {
  Problem<Yielding<QuadraticSpline, RightOf<S>, true>> problem;
  static_assert(LaggedTerm<std::decay_t<decltype(problem.term)>>);
  static_assert(!LaggedTerm<ElasticParticles<Elastic<FixedCorotated, FullProjection>>>);
  double const before = problem.oracle.value(problem.x_host);
  CHECK_THAT(problem.term.value(problem.x, 1), WithinRel(before, 1e-12));
  CHECK(problem.term.relag(problem.x));
  problem.oracle.lag = problem.x_host;
  double const after = problem.oracle.value(problem.x_host);
  CHECK(std::abs(after - before) > 1e-4 * before);
  CHECK_THAT(problem.term.value(problem.x, 1), WithinRel(after, 1e-12));
  CHECK_FALSE(problem.term.relag(problem.x));
  // The next step begins with its own.
  problem.term.update(problem.scene.particles, problem.scene.blocks, problem.scene.grid.nodes(),
                      problem.scene.rest);
  CHECK_THAT(problem.term.value(problem.x, 1), WithinRel(before, 1e-12));
}

using Solid = ElasticParticles<Hencky, QuadraticSpline, Fp64>;
using Minimiser = Ncg<DaiKou, BlockJacobi, ExactLineSearch, DecrementWindow, Fp64>;
using Stepper =
    ParticleStepper<ImplicitEuler<Minimiser>, QuadraticSpline, Apic, FlowOfMaterials<S>>;

/// A cube that is wrung: kinetic energy, and what flow has taken from it, after `steps` of h.
struct Wrung {
  double energy = 0;      ///< kinetic and elastic, J
  double dissipated = 0;  ///< in flow, J
  Vec3<double> momentum{};
  double strain = 0;  ///< mean plastic strain
};

constexpr double yield_stress = 2e3, hardening = 1e4;

Wrung measure(std::vector<Particle> const& list, Lame<double> const& lame, double dx) {
  Wrung sum;
  for (Particle const& p : list) {
    sum.energy += 0.5 * p.mass * (dot(p.v, p.v) + 0.25 * dx * dx * contract(p.C, p.C)) +
                  p.volume * Hencky::energy(hencky(lame), p.F);
    sum.dissipated += p.volume * p.plastic * (yield_stress + 0.5 * hardening * p.plastic);
    sum.momentum = sum.momentum + p.mass * p.v;
    sum.strain += p.plastic / double(list.size());
  }
  return sum;
}

template <class Visit>
Wrung wring(bool in_step, double h, double time, Visit const& visit) {
  double const dx = 0.1;
  Lame<double> const lame = lame_parameters(2e5, 0.3);
  VonMises const metal{lame.mu, yield_stress, hardening};
  auto list = jittered_block(4, 2, dx, {0.3, 0.2, -0.6});
  for (Particle& p : list) {
    double const rate = 25 * (p.x[1] - 0.22);  // 1/s of turning about y
    p.F = identity3<double>();
    p.C = 0.0 * identity3<double>();
    p.v = {rate * (p.x[2] + 0.4), 0.3, -rate * (p.x[0] - 0.5)};
    p.stiffness = 1;
    p.plastic = 0;
  }
  Particles<Fp64, S> const particles(list);
  ParticleGrid<QuadraticSpline, Fp64, S> grid(dx);
  Potential scene(grid.unknowns(), Inertia<Fp64>(grid.unknowns()),
                  Solid({in_step ? hencky(lame, metal) : hencky(lame)}));
  Stepper stepper(ImplicitEuler<Minimiser>({.stop = {.tolerance = 1e-6}}), {}, {},
                  FlowOfMaterials<S>({{.kind = FlowKind::von_mises, .metal = metal}}));
  int const steps = static_cast<int>(std::lround(time / h));
  for (int n = 0; n < steps; ++n) {
    CHECK(stepper.step(scene, grid, particles, h).minimiser.converged());
    visit(measure(particles.read(), lame, dx));
  }
  return measure(particles.read(), lame, dx);
}

TEST_CASE("a step of sand that was halved is that of half the time", "[mpm][yielding]") {
  double const dx = 0.1, h = 0.04;
  Lame<double> const lame = lame_parameters(1e5, 0.3);
  DruckerPrager const sand{lame.mu, lame.lambda, 30};
  auto list = jittered_block(2, 2, dx, {0.3, 0.2, -0.6});
  for (Particle& p : list) {
    p.F = 0.99 * identity3<double>();
    p.C = 0.0 * identity3<double>();
    p.v = {3, -2 * (p.x[1] - 0.12), 0};  // squeezed, and 1.2 cells of travel
    p.stiffness = 1;
    p.plastic = 0;
  }
  auto const after = [&](double asked, int halvings) {
    Particles<Fp64, S> const particles(list);
    ParticleGrid<QuadraticSpline, Fp64, S> grid(dx);
    Potential scene(grid.unknowns(), Inertia<Fp64>(grid.unknowns()), Solid({hencky(lame, sand)}));
    ParticleStepper<ImplicitEuler<Minimiser>> stepper(
        ImplicitEuler<Minimiser>({.stop = {.tolerance = 1e-4}}, {.passes = 2}));
    CHECK(stepper.step(scene, grid, particles, asked).halvings == halvings);
    return particles.read();
  };
  auto const halved = after(h, 1), direct = after(h / 2, 0);
  for (std::size_t p = 0; p < list.size(); ++p)
    CHECK_THAT(norm(halved[p].x - direct[p].x), WithinAbs(0, 1e-12 * dx));
}

TEST_CASE("a cube that is wrung flows, and no step makes energy", "[mpm][yielding]") {
  double last = std::numeric_limits<double>::infinity(), first = 0;
  Vec3<double> momentum{};
  Wrung const end = wring(true, 2e-3, 0.03, [&](Wrung const& now) {
    if (first == 0) first = now.energy + now.dissipated, momentum = now.momentum;
    CHECK(now.energy + now.dissipated < last * (1 + 1e-6));
    CHECK_THAT(norm(now.momentum - momentum), WithinAbs(0, 1e-5 * norm(momentum)));
    last = now.energy + now.dissipated;
  });
  CHECK(end.dissipated > 0.1 * first);
  CHECK(end.strain > 0.01);
}

TEST_CASE("the pressure by which sand yields settles in few minimisations", "[mpm][yielding]") {
  double const dx = 0.1, h = 2e-3;
  Lame<double> const lame = lame_parameters(2e5, 0.3);
  DruckerPrager const sand{.mu = lame.mu, .lambda = lame.lambda, .angle = 30};
  auto list = jittered_block(4, 2, dx, {0.3, 0.2, -0.6});
  for (Particle& p : list) {  // compressed, and pressed flat
    p.F = {{1.005, 0, 0, 0, 0.955, 0, 0, 0, 1.005}};
    p.C = 0.0 * identity3<double>();
    p.v = {0, -8 * (p.x[1] - 0.4), 0};
    p.stiffness = 1;
    p.plastic = 0;
  }
  auto const stepped = [&](int passes) {
    Particles<Fp64, S> const particles(list);
    ParticleGrid<QuadraticSpline, Fp64, S> grid(dx);
    Potential scene(grid.unknowns(), Inertia<Fp64>(grid.unknowns()), Solid({hencky(lame, sand)}));
    Stepper stepper(ImplicitEuler<Minimiser>({.stop = {.tolerance = 1e-7}}, {passes}), {}, {},
                    FlowOfMaterials<S>({{.kind = FlowKind::sand, .sand = sand}}));
    CHECK(stepper.step(scene, grid, particles, h).minimiser.converged());
    return particles.read();
  };
  auto const end = stepped(16);
  auto const apart = [&](std::vector<Particle> const& other) {
    double sum = 0;
    for (std::size_t p = 0; p < end.size(); ++p) {
      sum += dot(other[p].x - end[p].x, other[p].x - end[p].x);
    }
    return std::sqrt(sum / double(end.size()));
  };
  double const one = apart(stepped(1)), four = apart(stepped(4));
  CAPTURE(one, four);
  CHECK(one > 1e-6 * dx);
  CHECK(four < 0.1 * one);
}

TEST_CASE("what a body has flowed depends on the step less if it flows within it",
          "[mpm][yielding]") {
  auto const flowed = [](bool in_step, double h) {
    return wring(in_step, h, 0.024, [](Wrung const&) {}).strain;
  };
  double const exact = flowed(true, 5e-4);
  double const within = flowed(true, 4e-3), after = flowed(false, 4e-3);
  CAPTURE(exact, within, after);
  CHECK(std::abs(within - exact) < 0.2 * exact);
  CHECK(std::abs(within - exact) < 0.5 * std::abs(after - exact));
}

}  // namespace
}  // namespace taut
