// Terms of two models over the particles of one grid: that each sweeps its own, against the sums
// over all particles and nodes; and that splitting one model between two terms changes nothing, for
// every minimiser that goes by particles.
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/admm.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/ncg.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/models.hpp>
#include <taut/mpm/elastic_particles.hpp>
#include <taut/mpm/particle_multigrid.hpp>
#include <taut/mpm/particle_splitting.hpp>
#include <taut/mpm/particle_stepper.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include "particle_problem.hpp"

namespace taut {
namespace {

using namespace test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;
using P = Fp64;
using Soft = Elastic<FixedCorotated, FullProjection>;
using Firm = Elastic<NeoHookean, FullProjection>;

/// Material 0 is soft, 1 and 2 are firm.
template <class Space, bool packed>
struct Mixture {
  template <class Material>
  using Term = ElasticParticles<Material, QuadraticSpline, P, Space, packed>;
  template <class Material>
  using Oracle = ParticleOracle<Material>;
  using Positions = typename Term<Soft>::Positions;
  using Vectors = typename Term<Soft>::Vectors;
  using Blocks = typename Term<Soft>::Blocks;

  double dx = 0.05;
  std::vector<Particle> list = jittered_block(4, 2, dx, {-3.3, 5.2, 6.6}, 3);
  OnGrid<QuadraticSpline, P, Space> scene{list, dx, 3};
  Term<Soft> soft;
  Term<Firm> firm;
  Oracle<Soft> of_soft;
  Oracle<Firm> of_firm;
  Field x_host, p_host;
  Positions x;
  Vectors p;
  FixedMask<Space> fixed{"fixed", std::size_t(scene.nodes())};

  explicit Mixture(int team_size)
      : soft({{1e5, 1.5e5}}, 0, team_size),
        firm({{3e6, 1e6}, {2e4, 5e4}}, 1, team_size),
        of_soft{3, dx, {}, {{1e5, 1.5e5}}, scene.places(), {}},
        of_firm{3, dx, {}, {{3e6, 1e6}, {2e4, 5e4}}, scene.places(), {}} {
    for (Particle one : list) {
      if (one.material == 0) {
        of_soft.particles.push_back(one);
      } else {
        --one.material;
        of_firm.particles.push_back(one);
      }
    }
    soft.update(scene.particles, scene.blocks, scene.grid.nodes(), scene.rest);
    firm.update(scene.particles, scene.blocks, scene.grid.nodes(), scene.rest);
    JitteredNodes const nodes(scene.places(), dx);
    x_host = nodes.x;
    p_host = nodes.p;
    x = field_of<Positions>(x_host);
    p = field_of<Vectors>(p_host);
  }
};

Field sum(Field a, Field const& b, double scale = 1) {
  for (std::size_t i = 0; i < a.size(); ++i) a[i] = scale * (a[i] + b[i]);
  return a;
}

template <class Space, bool packed>
void check_sums(int team_size) {
  Mixture<Space, packed> const m(team_size);
  using Vectors = typename Mixture<Space, packed>::Vectors;
  constexpr double eps = 1e-12;
  double const h2 = 0.3;
  int const n = m.scene.nodes();
  // There are blocks of several patches, and nodes that both terms act on.
  auto const& views = m.scene.blocks.views();
  REQUIRE(views.patches > views.blocks);

  CHECK_THAT(m.soft.value(m.x, h2), WithinRel(h2 * m.of_soft.value(m.x_host), eps));
  CHECK_THAT(m.firm.value(m.x, h2), WithinRel(h2 * m.of_firm.value(m.x_host), eps));
  CHECK_THAT(m.firm.quadratic_form(m.x, m.p, h2),
             WithinRel(h2 * m.of_firm.quadratic_form(m.x_host, m.p_host), eps));
  Field moved(m.x_host);
  for (int i = 0; i < n; ++i) moved[i] = moved[i] + 0.7 * m.p_host[i];
  CHECK_THAT(m.firm.change(m.x, m.p, 0.7, h2),
             WithinRel(h2 * (m.of_firm.value(moved) - m.of_firm.value(m.x_host)), 100 * eps));

  Field const gradient = sum(m.of_soft.gradient(m.x_host), m.of_firm.gradient(m.x_host), h2);
  Field const diagonal = sum(m.of_soft.diagonal(m.x_host), m.of_firm.diagonal(m.x_host), h2);
  Field const product =
      sum(m.of_soft.product(m.x_host, m.p_host), m.of_firm.product(m.x_host, m.p_host), h2);
  Vectors const g("g", n), d("d", n), hp("hp", n), after("after", n);
  m.soft.add_gradient(m.x, h2, m.fixed, g, d);
  m.firm.add_gradient(m.x, h2, m.fixed, g, d);
  CHECK(difference(read(g), gradient) < eps * largest(gradient));
  CHECK(difference(read(d), diagonal) < 10 * eps * largest(diagonal));
  m.soft.add_product(m.x, m.p, h2, m.fixed, hp);
  m.firm.add_product(m.x, m.p, h2, m.fixed, hp);
  CHECK(difference(read(hp), product) < 3 * eps * largest(product));
  for (int i = 0; i < n; ++i) moved[i] = m.x_host[i] - m.p_host[i];
  CHECK_THAT(m.firm.add_gradient_after(m.x, m.p, 1, h2, m.fixed, after),
             WithinRel(h2 * (m.of_firm.value(m.x_host) - m.of_firm.value(moved)), 100 * eps));

  // The matrix, and one operator that both write to.
  std::vector<Connectivity> kinds;
  m.soft.elements(kinds);
  typename decltype(m.soft)::Matrix const matrix(pattern_from_elements(n, kinds));
  m.soft.add_to(matrix, m.x, h2, m.fixed);
  m.firm.add_to(matrix, m.x, h2, m.fixed);
  auto const host = host_copy(matrix);
  Field by_matrix(n, Vec3<double>{});
  for (int i = 0; i < n; ++i)
    for (int k = host.row_begin(i); k < host.row_begin(i + 1); ++k) {
      by_matrix[i] = by_matrix[i] + host.block(k) * m.p_host[host.column(k)];
    }
  CHECK(difference(by_matrix, product) < 1e-11 * largest(product));
  ParticleOperator<QuadraticSpline, double, Space, packed> both;
  m.firm.linearise(m.x, h2, both);
  m.soft.linearise(m.x, h2, both);
  BlockField<double, Space> const none("none", n);
  both.set_local(none, m.fixed);
  Vectors const by_operator("by_operator", n);
  both.product(m.p, by_operator);
  CHECK(difference(read(by_operator), product) < 1e-11 * largest(product));

  // What residuals are measured by, of both, weighed by mass.
  Array<double, Space> const mass("mass", n), force("force", n);
  std::vector<double> exact(n, 0.0), exact_mass(n, 0.0);
  auto const add = [&](auto const& oracle, double norm, int material) {
    for (Particle const& one : oracle.particles)
      for (int i = 0; i < n; ++i) {
        double const w = one.mass * oracle.weight(one, i);
        if (one.material != material) continue;
        exact_mass[i] += w;
        exact[i] += 24 * m.dx * m.dx * w * norm * one.stiffness;
      }
  };
  add(m.of_soft, norm_at_rest<Soft>(m.of_soft.materials[0]), 0);
  add(m.of_firm, norm_at_rest<Firm>(m.of_firm.materials[0]), 0);
  add(m.of_firm, norm_at_rest<Firm>(m.of_firm.materials[1]), 1);
  m.soft.add_characteristic_force(force, mass);
  m.firm.add_characteristic_force(force, mass);
  auto const found = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), force),
             found_mass = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), mass);
  double wrong = 0;
  for (int i = 0; i < n; ++i) {
    if (!(exact_mass[i] > 0)) continue;
    wrong = std::max(
        {wrong, std::abs(found(i) / exact[i] - 1), std::abs(found_mass(i) / exact_mass[i] - 1)});
  }
  CHECK(wrong < 1e-10);
}

/// A term none of whose materials has a particle here.
template <class Space, bool packed>
void check_idle(int team_size) {
  Mixture<Space, packed> const m(team_size);
  typename Mixture<Space, packed>::template Term<Firm> idle({{3e6, 1e6}}, 3, team_size);
  idle.update(m.scene.particles, m.scene.blocks, m.scene.grid.nodes(), m.scene.rest);
  int const n = m.scene.nodes();
  typename Mixture<Space, packed>::Vectors const g("g", n), d("d", n);
  idle.add_gradient(m.x, 1, m.fixed, g, d);
  idle.add_product(m.x, m.p, 1, m.fixed, g);
  CHECK(largest(read(g)) == 0);
  CHECK(largest(read(d)) == 0);
  CHECK(idle.value(m.x, 1) == 0);
  CHECK(idle.add_gradient_after(m.x, m.p, 1, 1, m.fixed, g) == 0);
  double certified = 100;
  CHECK(idle.quadratic_form(m.x, m.p, 1, certified) == 0);
  CHECK(certified == 100);
  CHECK(idle.max_step(m.x, m.p, 100) == 100);
}

/// A step bound by inversion, which only the firm ones forbid.
template <class Space, bool packed>
void check_bound(int team_size) {
  Mixture<Space, packed> const m(team_size);
  Field far(m.p_host);
  for (auto& v : far) v = 30.0 * v;
  using Vectors = typename Mixture<Space, packed>::Vectors;
  auto const p = field_of<Vectors>(far);
  auto const smallest = [&](auto const& oracle, double t) {
    Field moved(m.x_host);
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i] = moved[i] + t * far[i];
    auto const u = oracle.displacements(moved);
    double least = 1e300;
    for (Particle const& one : oracle.particles) {
      least = std::min(least, determinant(one.F + oracle.change_of_F(one, u)));
    }
    return least;
  };
  double const t = m.firm.max_step(m.x, p, 100);
  REQUIRE(t < 100);
  double const first = t / decltype(m.firm)::margin;
  CHECK(smallest(m.of_firm, 0.999 * first) > 0);
  CHECK(smallest(m.of_firm, 1.001 * first) < 0);
  CHECK(m.soft.max_step(m.x, p, 100) == 100);
}

using BothTerms = ElasticParticles<Soft, QuadraticSpline, P>;
template <class... Terms>
using SceneOf = Potential<Inertia<P>, BodyForce<P>, Terms...>;

/// The particles after three steps.
template <class Minimiser, class... Terms>
std::vector<Particle> run(typename Minimiser::Params const& params, Terms const&... terms) {
  std::vector<Particle> list = jittered_block(5, 2, 0.1, {-2.3, 0.2, 6.6}, 2, 0.05);
  for (Particle& one : list) one.v = {0, -1, 0};
  Particles<P> const particles(list);
  ParticleGrid<QuadraticSpline, P> grid(0.1);
  SceneOf<Terms...> scene(grid.unknowns(), Inertia<P>(grid.unknowns()),
                          BodyForce<P>(grid.unknowns(), {0, -9.81, 0}), terms...);
  ParticleStepper<ImplicitEuler<Minimiser>> stepper{ImplicitEuler<Minimiser>(params)};
  BoundaryList<DefaultSpace> floor(
      {{.name = "floor", .motion = at_rest({identity3<double>(), {0, 0.05, 0}})}});
  for (int k = 0; k < 3; ++k) {
    auto const report = stepper.step(scene, grid, particles, 0.01, floor);
    CHECK(report.minimiser.converged());
  }
  return particles.read();
}

template <class Minimiser>
void check_minimiser(double tolerance) {
  typename Minimiser::Params params{};
  params.stop.tolerance = tolerance;
  std::vector<Lame<double>> const materials{lame_parameters(1e5, 0.3), lame_parameters(1e7, 0.3)};
  auto const by_one = run<Minimiser>(params, BothTerms(materials));
  auto const by_two =
      run<Minimiser>(params, BothTerms({materials[0]}), BothTerms({materials[1]}, 1));
  double apart = 0;
  for (std::size_t k = 0; k < by_one.size(); ++k) {
    apart = std::max(apart, norm(by_one[k].x - by_two[k].x));
  }
  CHECK(apart < 1e-9);
}

}  // namespace

TEST_CASE("two models share the particles of a grid", "[mpm][models]") {
  check_sums<RightOf<DefaultSpace>, true>(1);
  check_bound<RightOf<DefaultSpace>, true>(1);
  check_idle<RightOf<DefaultSpace>, true>(1);
}
TEST_CASE("two models share them in a device's layout, a thread a particle", "[mpm][models]") {
  int const team = team_sizes<DefaultSpace>().back();
  check_sums<LeftOf<DefaultSpace>, false>(team);
  check_bound<LeftOf<DefaultSpace>, false>(team);
  check_idle<LeftOf<DefaultSpace>, false>(team);
}

TEST_CASE("own patches are what they were among all", "[mpm][models]") {
  Mixture<RightOf<DefaultSpace>, true> const m(1);
  auto const& all = m.scene.blocks.views();
  OwnPatches<QuadraticSpline> patches;
  auto const& own = patches.select(all, {1, 3}, m.scene.nodes());
  REQUIRE(own.patches > 0);
  REQUIRE(own.patches < all.patches);
  int k = 0;
  for (int patch = 0; patch < all.patches; ++patch) {
    CHECK(all.nodes_of(patch)[all.heart(patch)] >= 0);
    if (all.material(patch) == 0) continue;
    REQUIRE(k < own.patches);
    CHECK(own.material(k) == all.material(patch) - 1);
    CHECK(own.slot_begin(k) == all.slot_begin(patch));
    CHECK(own.slot_end(k) == all.slot_end(patch));
    CHECK(own.count(k) == all.count(patch));
    CHECK(own.block(k) == all.block(patch));
    CHECK(own.heart(k) == all.heart(patch));
    ++k;
  }
  CHECK(k == own.patches);
}

TEST_CASE("steps of two terms are those of one", "[mpm][models]") {
  check_minimiser<Lbfgs<ParticleMultigrid, SufficientDecrease, DecrementWindow, P>>(1e-9);
  check_minimiser<Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, P>>(1e-9);
  check_minimiser<Admm<ParticleSplitting<P>, DecrementWindow, P>>(1e-9);
}

TEST_CASE("materials that no term holds, or two, are refused", "[mpm][models]") {
  using Minimiser = Lbfgs<ParticleMultigrid, SufficientDecrease, DecrementWindow, P>;
  auto const lame = lame_parameters(1e5, 0.3);
  CHECK_THROWS_WITH(run<Minimiser>({}, BothTerms({lame}, 1)),
                    ContainsSubstring("no term over the particles holds material 0"));
  CHECK_THROWS_WITH(run<Minimiser>({}, BothTerms({lame, lame}), BothTerms({lame}, 1)),
                    ContainsSubstring("2 terms over the particles hold one material"));
  CHECK_THROWS_WITH(BothTerms({lame}, -1), ContainsSubstring("give 0 or more"));
}

}  // namespace taut
