// Nonlinear CG in lower precision: what it reaches, and that it stops there.
#include "oracle.hpp"

#include <taut/integrators/ncg.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

using namespace taut;

namespace {

template <class P>
using NcgIn = Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, P>;

}  // namespace

TEMPLATE_TEST_CASE("lower precision reaches what it can resolve", "", Mixed, Fp32) {
  toy::ChainParams const chain_params;
  toy::Chain<toy::Quartic, TestType> chain(chain_params);
  toy::Chain<toy::Quartic> const twin(chain_params);

  typename NcgIn<TestType>::Params params;
  params.stop.tolerance = 1e-4;
  auto x = chain.start();
  auto report = NcgIn<TestType>(params).minimise(chain, x);
  CHECK(report.converged());
  CHECK(toy::distance_to_minimum(twin, x) < 3e-4 * chain.scale().length);

  // Asked for more than there is, it says so instead of running on.
  params.stop.tolerance = 1e-12;
  params.budget.max_iterations = 5000;
  x = chain.start();
  report = NcgIn<TestType>(params).minimise(chain, x);
  CHECK(report.stop == Stop::stalled);
  CHECK(toy::distance_to_minimum(twin, x) < 3e-5 * chain.scale().length);
}
