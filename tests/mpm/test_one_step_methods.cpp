// The step of test_one_step.cpp by HOT and the methods that it is compared with: how the
// characteristic norm falls, how many iterations that takes, and where it ends, against logs of an
// independent implementation.
#include <taut/integrators/inverse_by_pcg.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/momentum_norm.hpp>
#include <taut/integrators/newton.hpp>
#include <taut/mpm/particle_hessian.hpp>
#include <taut/mpm/particle_multigrid.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include "golden_block.hpp"
#include "particle_scenes.hpp"

namespace taut {
namespace {

using Catch::Matchers::WithinRel;
using S = DefaultSpace;
using P = Fp64;
using Solid = ElasticParticles<Elastic<FixedCorotated, FullProjection>, QuadraticSpline, P>;
using Step = test::GoldenStep<Solid>;

using HotCycle = ParticleCyclePolicies<true, SymmetricGaussSeidel, SymmetricGaussSeidel,
                                       LinearEmbedding, double>;
template <class P_, class S_>
using HotMultigrid = ParticleMultigrid<P_, S_, HotCycle>;

using Hot = Lbfgs<HotMultigrid, SufficientDecrease, CharacteristicNorm<>, P>;
using LbfgsH = Lbfgs<InverseByPcg, SufficientDecrease, CharacteristicNorm<>, P>;
using PnPcg =
    Newton<AssembledPcg, BlockJacobi, SufficientDecrease, CharacteristicNorm<>, P, S, RootForcing>;
using PnMgpcg =
    Newton<AssembledPcg, HotMultigrid, SufficientDecrease, CharacteristicNorm<>, P, S, RootForcing>;
template <class P_, class S_>
using Numbers = ParticleHessian<P_, S_, false>;
template <class P_, class S_>
using NumbersPcg = Pcg<P_, S_, Numbers>;
using Gast =
    Newton<NumbersPcg, BlockJacobi, SufficientDecrease, MomentumNorm<>, P, S, MomentumForcing>;

constexpr LbfgsParams hot_pairs{.window = 8,
                                .newton_step = false,
                                .newton_after_backtracks = false,
                                .newton_first_step = false};

HotMultigrid<P, S>::Params hot_cycle(Refresh const& refresh) {
  return {.refresh = refresh,
          .cycle = {.max_levels = 3, .direct_nodes = 0, .coarse_tolerance = 0.5}};
}
constexpr Refresh once{.interval = std::numeric_limits<int>::max()};

/// `within`: how many iterations more or fewer than the log's; `exact`: the norms are those of the
/// log, all the way.
template <class Minimiser>
void check(Step& step, typename Minimiser::Params const& params, char const* name, int within,
           bool exact) {
  INFO(name);
  auto const log = step.golden.at("solvers_eps1e-7").at(name);
  std::vector<double> const expected = log.at("cn_history");
  auto const x = step.start();
  Minimiser minimiser(params);
  std::vector<double> norms;
  CharacteristicNorm<> norm;
  norm.start(step.scene.scale());
  Solid::Vectors const g("g", step.grid.size());
  auto const note = [&](auto const& at) {
    step.scene.gradient(at, g);
    norm.judge(step.scene, g);
    norms.push_back(norm.norm());
  };
  note(x);
  auto const report = minimiser.minimise(step.scene, x, [&](auto const& i) { note(i.x); });
  CHECK(report.stop == Stop::converged_by_gradient);
  CHECK(report.backtracks == 0);
  CHECK(std::abs(report.iterations - int(log.at("iters"))) <= within);
  CHECK(report.iterations + 1 == int(norms.size()));
  CHECK(norms.back() < 1e-7);
  CHECK_THAT(norms.front(), WithinRel(expected[0], 1e-9));
  if (!exact) return;
  REQUIRE(norms.size() == expected.size());
  for (std::size_t k = 0; k < norms.size(); ++k) CHECK_THAT(norms[k], WithinRel(expected[k], 1e-3));
}

TEST_CASE("HOT and what it is compared with take the steps of the reference", "[mpm][hot]") {
  for (std::string const which : {"stretch", "drop", "hetero"}) {
    INFO(which);
    Step step(which);
    // The reference keeps fixed nodes in its hierarchy, with blocks of one kilogram; here they are
    // left out.
    bool const free = which == "stretch";
    check<Hot>(step, {.lbfgs = hot_pairs, .preconditioner = hot_cycle(once)}, "HOT_3level",
               free ? 0 : 1, false);
    check<LbfgsH>(step, {.lbfgs = hot_pairs}, "LBFGS-H", 0, true);
    check<PnPcg>(step, {.linear = {.max_iterations = 10000}}, "PN-PCG", 0, true);
    check<PnMgpcg>(step, {.preconditioner = hot_cycle({})}, "PN-MGPCG", free ? 0 : 1, false);
  }
}

/// How far the energy is above the least, relative to what the step changes.
void check_minimum(Step& step, Solid::Positions const& x, double error) {
  double const reference = step.golden.at("reference").at("E"), first = step.golden.at("E0");
  CHECK(std::abs(step.energy(x) - reference) < error * (first - reference));
}

TEST_CASE("methods with geometric levels, and that of Gast et al., end where the reference does",
          "[mpm][hot]") {
  for (std::string const which : {"stretch", "drop", "hetero"}) {
    INFO(which);
    Step step(which);
    // The tolerance is tight: at 1e-7 that of a jump in stiffness is an error of 2 per cent.
    double const error = which == "hetero" ? 1e-6 : 1e-9;
    CharacteristicNorm<>::Params const stop{.tolerance = 1e-10};
    auto geometric = hot_cycle(once);
    geometric.geometric = true;
    Hot lbfgs_gmg({.lbfgs = hot_pairs, .preconditioner = geometric, .stop = stop});
    auto x = step.start();
    CHECK(lbfgs_gmg.minimise(step.scene, x).stop == Stop::converged_by_gradient);
    check_minimum(step, x, error);

    geometric.refresh = {};
    for (bool const flexible : {false, true}) {
      PnMgpcg pn_gmgpcg(
          {.linear = {.flexible = flexible}, .preconditioner = geometric, .stop = stop});
      x = step.start();
      CHECK(pn_gmgpcg.minimise(step.scene, x).stop == Stop::converged_by_gradient);
      check_minimum(step, x, error);
    }

    // |g / h| < tolerance, by its definition.
    Gast gast({.forcing = {.tolerance = 1e-6}, .stop = {.tolerance = 1e-6}});
    x = step.start();
    auto const report = gast.minimise(step.scene, x);
    CHECK(report.stop == Stop::converged_by_gradient);
    check_minimum(step, x, error);
    Solid::Vectors const g("g", step.grid.size());
    step.scene.gradient(x, g);
    double square = 0;
    for (int i = 0; i < step.grid.size(); ++i)
      for (int c = 0; c < 3; ++c) square += g(i, c) * g(i, c) / (step.h * step.h);
    CHECK(std::sqrt(square) < 1e-6);
  }
}

TEST_CASE("geometric levels are the Hessians of coarser grids around the same particles",
          "[mpm][hot]") {
  for (std::string const which : {"stretch", "drop"}) {
    INFO(which);
    Step step(which);
    // Where the grid has not moved, F is that of the particles on each grid.
    auto params = hot_cycle({});
    params.geometric = true;
    HotMultigrid<P, S> multigrid(params);
    multigrid.resize(step.grid.size());
    multigrid.update(step.scene, step.grid.rest());
    REQUIRE(multigrid.report().nodes.size() == 3);
    for (int l : {0, 1}) {
      INFO(l);
      Step coarse(which, l == 0 ? 2 : 4);
      auto const& level = multigrid.cycle().level(l);
      int const n = coarse.grid.size();
      REQUIRE(level.size() == n);
      auto const expected = coarse.scene.pattern(coarse.grid.rest());
      coarse.scene.assemble(coarse.grid.rest(), expected);
      double wrong = 0, most = 0;
      int blocks = 0;
      for (int i = 0; i < n; ++i) {
        int const own =
            level.nodes().node(coarse.grid.nodes().ijk(i, 0), coarse.grid.nodes().ijk(i, 1),
                               coarse.grid.nodes().ijk(i, 2));
        REQUIRE(own >= 0);
        CHECK((level.fixed()(own) != 0) == (coarse.grid.unknowns().fixed(i) != 0));
        for (int k = expected.row_begin(i); k < expected.row_begin(i + 1); ++k) {
          int d[3];
          for (int c = 0; c < 3; ++c) {
            d[c] = coarse.grid.nodes().ijk(expected.column(k), c) - coarse.grid.nodes().ijk(i, c);
          }
          Mat3<double> const difference =
              level.matrix().block(own, d[0], d[1], d[2]) - expected.block(k);
          wrong = std::max(wrong, std::sqrt(contract(difference, difference)));
          most = std::max(most, std::sqrt(contract(expected.block(k), expected.block(k))));
          ++blocks;
        }
      }
      CHECK(blocks > n);
      CHECK(wrong < 1e-12 * most);
    }
  }
}

TEST_CASE("Newton takes its Hessian from a cycle that is made of it", "[mpm][hot]") {
  Step step("stretch");
  HotMultigrid<P, S> lends(hot_cycle({})), keeps(hot_cycle(once));
  CHECK(lends.holds_hessian());
  CHECK_FALSE(keeps.holds_hessian());
  auto const x = step.start();
  lends.resize(step.grid.size());
  lends.update(step.scene, x);
  Solid::Vectors const d("d", step.grid.size()), lent("lent", step.grid.size()),
      exact("exact", step.grid.size());
  for (int i = 0; i < step.grid.size(); ++i)
    for (int c = 0; c < 3; ++c) d(i, c) = std::sin(3 * i + c);
  lends.hessian_product(d, lent);
  step.scene.product(x, d, exact);
  double wrong = 0, most = 0;
  for (int i = 0; i < step.grid.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      wrong = std::max(wrong, std::abs(lent(i, c) - exact(i, c)));
      most = std::max(most, std::abs(exact(i, c)));
    }
  CHECK(wrong < 1e-12 * most);
}

TEST_CASE("a cycle without a fine matrix, with patches, ends where the reference does",
          "[mpm][hot]") {
  using Minimiser = Lbfgs<ParticleMultigrid, SufficientDecrease, DecrementWindow, P>;
  struct {
    char const* name;
    double error;  ///< of the energy, relative to what the step changes
    int most;      ///< iterations
  } const cases[] = {{"stretch", 1e-9, 25}, {"drop", 1e-9, 12}, {"hetero", 1e-6, 50}};
  for (auto const& [name, error, most] : cases) {
    INFO(name);
    Step step(name);
    auto const x = step.start();
    Minimiser minimiser({.lbfgs = {.window = 8, .newton_step = false},
                         .preconditioner = {.refresh = Refresh::lagged(8),
                                            .cut_cells = {.ratio = 1e-2},
                                            .cycle = {.direct_nodes = 20}},
                         .stop = {.tolerance = 1e-5}});
    auto const report = minimiser.minimise(step.scene, x);
    double const reference = step.golden.at("reference").at("E"), first = step.golden.at("E0");
    CHECK(report.converged());
    CHECK(report.iterations <= most);
    CHECK(report.refreshes == (report.iterations + 7) / 8);
    CHECK(std::abs(step.energy(x) - reference) < error * (first - reference));
  }
}

/// A block of aluminium on a floor that it sticks to, in cells that waves cross 5000 of in the
/// step: what holds nodes that hardly any particle sees is 1e-7 of what holds the others.
struct MetalStep {
  using Scene = Potential<Inertia<P, S>, BodyForce<P, S>, Solid>;
  static constexpr double dx = 0.02, h = 1. / 48;
  Particles<P, S> particles;
  ParticleGrid<QuadraticSpline, P, S> grid;
  Scene scene;

  MetalStep()
      : particles(block()),
        grid(dx),
        scene(grid.unknowns(), Inertia<P, S>(grid.unknowns()),
              BodyForce<P, S>(grid.unknowns(), {0, -9.8, 0}),
              Solid({lame_parameters(6.9e10, 0.33)})) {
    grid.rebuild(particles, 1);
    scene.resize(grid.unknowns());
    scene.term<Solid>().update(particles, grid.blocks(), grid.nodes(), grid.rest());
    std::vector<BoundarySpec> const floor{
        {.name = "floor", .motion = at_rest({identity3<double>(), {0, 0.4 * dx, 0}})}};
    BoundaryList<S> boundaries(floor);
    boundaries.set_time(h);
    grid.fix(boundaries, h);
    auto const& target = scene.term<Inertia<P, S>>().target();
    assign(target, grid.rest());
    scene.begin_step(grid.rest(), h * h, h, true);
  }
  static std::vector<Particle> block() {
    std::vector<Particle> list = test::jittered_block(6, 2, dx, {0.31, 0.17, 0.43}, 1, 1e-5);
    for (Particle& p : list) {
      p.v = {};
      p.C = {};
      p.stiffness = 1;
      p.mass = 2700 * p.volume;
    }
    return list;
  }
  Solid::Positions start() const {
    Solid::Positions const x("x", grid.size());
    assign(x, grid.rest());
    return x;
  }
};

template <class T>
using CycleIn = ParticleCyclePolicies<false, Chebyshev, ForwardBackward, LinearEmbedding, float,
                                      QuadraticSpline, T>;
template <class P_, class S_>
using DoubleMultigrid = ParticleMultigrid<P_, S_, CycleIn<double>>;

TEST_CASE("floats do for the fine level of a cycle, also where nodes are light", "[mpm][hot]") {
  MetalStep step;
  BlockField<double, S> const local("local", step.grid.size());
  auto const largest = [&]<class T>(T) {
    using Operator = ParticleOperator<QuadraticSpline, T, S>;
    Operator to;
    to.linearise(step.scene, step.start(), local);
    ActionLevel<Operator, S, T> level;
    level.resize(to.nodes(), to.fixed(), to);
    level.finish();
    LevelVectors<T, S> v;
    v.resize(level.size());
    return largest_eigenvalue(level, v, 20, 0);
  };
  CHECK_THAT(largest(0.0f), WithinRel(largest(0.0), 1e-2));

  auto const run = [&]<class Minimiser>(std::type_identity<Minimiser>, int from) {
    auto const x = step.start();
    Minimiser minimiser({.lbfgs = {.newton_step = false},
                         .preconditioner = {.strengthening = {.from = from}},
                         .stop = {.tolerance = 1e-3, .window = 4},
                         .budget = {.max_iterations = 2000}});
    return minimiser.minimise(step.scene, x);
  };
  std::type_identity<Lbfgs<ParticleMultigrid, SufficientDecrease, DecrementWindow, P>> const floats;
  std::type_identity<Lbfgs<DoubleMultigrid, SufficientDecrease, DecrementWindow, P>> const doubles;
  for (int const from : {0, 1}) {
    auto const rounded = run(floats, from), exact = run(doubles, from);
    CAPTURE(from, rounded.iterations, exact.iterations);
    CHECK(rounded.converged());
    CHECK(rounded.iterations <= 1.1 * exact.iterations + 2);
    CHECK_THAT(rounded.energy_change, WithinRel(exact.energy_change, 1e-3));
  }
}

TEST_CASE("a strong cycle ends a stiff step in fewer iterations", "[mpm][hot]") {
  using Minimiser = Lbfgs<ParticleMultigrid, SufficientDecrease, DecrementWindow, P>;
  MetalStep step;
  auto const run = [&](int from, double tolerance = 1e-3, int most_light = 3000) {
    auto const x = step.start();
    Minimiser minimiser(
        {.lbfgs = {.newton_step = false},
         .preconditioner = {.refresh = Refresh::lagged(8),
                            .strengthening = {.from = from, .most_light = most_light}},
         .stop = {.tolerance = tolerance, .window = 4},
         .budget = {.max_iterations = 2000}});
    return minimiser.minimise(step.scene, x);
  };
  auto const plain = run(0), strong = run(2), always = run(1);
  CAPTURE(plain.iterations, strong.iterations, always.iterations);
  CHECK(plain.converged());
  CHECK(plain.iterations > strong.iterations);
  CHECK(plain.iterations > 2 * always.iterations);
  CHECK(plain.strengthened == 0);
  CHECK(strong.converged());
  CHECK(strong.iterations > 8);
  CHECK(strong.iterations < 60);
  CHECK(strong.strengthened == strong.refreshes - 1);
  CHECK(always.converged());
  CHECK(always.iterations < 50);
  CHECK(always.strengthened == always.refreshes);
  // Where there are too many light nodes the coarser level is exact all the same.
  auto const without_light = run(1, 1e-3, 0);
  CAPTURE(without_light.iterations);
  CHECK(without_light.converged());
  CHECK(without_light.strengthened == without_light.refreshes);
  CHECK(without_light.iterations < plain.iterations);
  CHECK(std::abs(strong.energy_change - always.energy_change) <
        1e-3 * std::abs(always.energy_change));

  // What the plain one says of its error holds: half of M e^2 is no more than the energy left.
  double const exact = run(1, 1e-7).energy_change;
  for (double const tolerance : {1e-2, 1e-3}) {
    auto const report = run(0, tolerance);
    double const error =
        std::sqrt(2 * std::max(report.energy_change - exact, 0.0) / step.scene.scale().mass);
    CAPTURE(tolerance, report.iterations, error, report.error_estimate_m);
    CHECK(report.converged());
    CHECK(error < 3 * report.error_estimate_m);
  }
}

}  // namespace
}  // namespace taut
