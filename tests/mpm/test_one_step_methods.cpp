// The step of test_one_step.cpp by HOT and the methods that it is compared with: how the
// characteristic norm falls, how many iterations that takes, and where it ends, against logs of an
// independent implementation.
#include <taut/integrators/inverse_by_pcg.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/newton.hpp>
#include <taut/mpm/particle_multigrid.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include "golden_block.hpp"

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

constexpr LbfgsParams hot_pairs{.window = 8, .newton_step = false, .newton_first_step = false};

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
    Minimiser minimiser(
        {.lbfgs = {.window = 8, .newton_step = false},
         .preconditioner = {.cut_cells = {.ratio = 1e-2}, .cycle = {.direct_nodes = 20}},
         .stop = {.tolerance = 1e-5}});
    auto const report = minimiser.minimise(step.scene, x);
    double const reference = step.golden.at("reference").at("E"), first = step.golden.at("E0");
    CHECK(report.converged());
    CHECK(report.iterations <= most);
    CHECK(report.refreshes == (report.iterations + 7) / 8);
    CHECK(std::abs(step.energy(x) - reference) < error * (first - reference));
  }
}

}  // namespace
}  // namespace taut
