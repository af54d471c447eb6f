// Restarts are counted by cause, and a rebuilt preconditioner is none.
#include "toy_objectives.hpp"

#include <taut/integrators/ncg.hpp>

#include <catch2/catch_test_macros.hpp>

#include <cmath>
#include <limits>
#include <vector>

using namespace taut;

namespace {

template <class Beta>
using NcgOf = Ncg<Beta, BlockJacobi, SufficientDecrease, DecrementWindow, Fp64>;

/// g'p = +g'P g.
struct Uphill {
  Coefficients operator()(Dots const& d) const { return {.gamma = 2 * d.g1_P1_g1 / d.g1_P1_y}; }
};
struct NotANumber {
  Coefficients operator()(Dots const&) const { return {std::numeric_limits<double>::quiet_NaN()}; }
};

/// Claims that energy rises, from one evaluation on and for some.
struct Stubborn : toy::Chain<toy::Anisotropic> {
  int from, count;
  mutable int evaluations = 0;
  Stubborn(int from_, int count_) : from(from_), count(count_) {}
  template <class... Curvature>
  double gradient_after(Positions const& x, Field const& p, double alpha, Field const& g,
                        Curvature const&... curvature) const {
    double const change = Chain::gradient_after(x, p, alpha, g, curvature...);
    int const k = evaluations++ - from;
    return k >= 0 && k < count ? 1e9 : change;
  }
};

/// Claims to be a hundred times as stiff as it is, as filtered curvature may be.
struct Overestimated : toy::Anisotropic {
  template <class T>
  KOKKOS_FUNCTION Mat3<T> curvature(Vec3<T> const& d) const {
    return T(100) * Anisotropic::curvature(d);
  }
};

template <class Beta>
typename NcgOf<Beta>::Params brief() {
  typename NcgOf<Beta>::Params params;
  params.stop.tolerance = 0;
  params.budget.max_iterations = 9;
  return params;
}

}  // namespace

TEST_CASE("directions that lead uphill are counted") {
  toy::Chain<toy::Anisotropic> chain;
  auto const report = NcgOf<Uphill>(brief<Uphill>()).minimise(chain, chain.start());
  CHECK(report.restarts.not_descent == 8);  // the first direction has no past
  CHECK(report.restarts.total() == 8);
}

TEST_CASE("betas that are no numbers are counted") {
  toy::Chain<toy::Anisotropic> chain;
  auto const report = NcgOf<NotANumber>(brief<NotANumber>()).minimise(chain, chain.start());
  CHECK(report.restarts.curvature == 8);
  CHECK(report.restarts.total() == 8);
}

TEST_CASE("directions along which nothing decreases are counted") {
  // All trials of the third step are refused; along -P g the energy falls again.
  Stubborn chain(2, SufficientDecrease::Params().max_backtracks + 1);
  std::vector<double> betas;
  auto const report =
      NcgOf<DaiKou>(brief<DaiKou>()).minimise(chain, chain.start(), [&](auto const& step) {
        betas.push_back(step.beta);
      });
  CHECK(report.restarts.armijo == 1);
  CHECK(report.restarts.total() == 1);
  REQUIRE(betas.size() == 9);
  for (int k = 0; k < 9; ++k) CHECK((betas[k] == 0) == (k == 0 || k == 2));
}

TEST_CASE("a step goes on along its direction where curvature was overestimated") {
  auto const minimise = [](bool goes_on) {
    toy::Chain<Overestimated> chain;
    NcgOf<DaiKou>::Params params;
    params.budget.max_iterations = 5000;
    if (!goes_on) params.safeguard.still_steep = toy::infinity;
    return NcgOf<DaiKou>(params).minimise(chain, chain.start());
  };
  auto const with = minimise(true), without = minimise(false);
  CAPTURE(with.iterations, without.iterations);
  CHECK(with.converged());
  CHECK(with.extended > 0);
  CHECK(without.extended == 0);
  CHECK(3 * with.iterations < without.iterations);
  // Both end in the same minimum: as much energy is lost.
  CHECK(std::abs(with.energy_change - without.energy_change) < 1e-4 * -with.energy_change);

  toy::Chain<toy::Anisotropic> right;  // where the model is right no step does
  CHECK(NcgOf<DaiKou>().minimise(right, right.start()).extended == 0);
}

TEST_CASE("a rebuilt preconditioner does not restart the direction") {
  toy::Chain<toy::Anisotropic> chain;
  auto params = brief<DaiKou>();
  params.preconditioner.refresh = Refresh::lagged(4);
  params.budget.max_iterations = 12;
  std::vector<double> betas;
  auto const report = NcgOf<DaiKou>(params).minimise(
      chain, chain.start(), [&](auto const& step) { betas.push_back(step.beta); });
  CHECK(report.refreshes == 3);
  CHECK(report.restarts.total() == 0);
  REQUIRE(betas.size() == 12);
  CHECK(betas[4] != 0);
  CHECK(betas[8] != 0);
}

TEST_CASE("a preconditioner that is rebuilt rarely is, where steps collapse") {
  RefreshClock clock(Refresh::rarely());
  CHECK(clock.due());
  clock.updated();
  for (int k = 0; k < 28; ++k) {
    clock.stepped(k == 3 ? 2.0 : 0.3);
    CHECK_FALSE(clock.due());
  }
  CHECK_FALSE(clock.due_after_step());
  clock.stepped(0.3);
  CHECK(clock.due_after_step());
  clock.stepped(0.3);
  CHECK(clock.due());  // the 30th

  clock.updated();
  clock.stepped(2);
  clock.stepped(0.21);
  CHECK_FALSE(clock.due());
  clock.stepped(0.19);  // less than a tenth of the longest
  CHECK(clock.due());
  clock.updated();
  clock.stepped(0.19);  // the longest now
  CHECK_FALSE(clock.due());
}
