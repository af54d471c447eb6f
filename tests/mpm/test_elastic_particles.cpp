// The elastic term over particles against plain loops over all nodes, in fp64.
#include <taut/materials/models.hpp>

#include "particle_problem.hpp"

#include <catch2/catch_test_macros.hpp>

namespace taut::test {
namespace {

TEST_CASE("sweeps over particles are the sums over all nodes: fixed corotated, quadratic",
          "[mpm][particles]") {
  check_sweeps<Combination<FixedCorotated, FullProjection, QuadraticSpline, Fp64,
                           RightOf<DefaultSpace>, true>>();
}

TEST_CASE("sweeps over particles are the sums over all nodes: stable neo-Hookean, cubic",
          "[mpm][particles]") {
  check_sweeps<
      Combination<StableNeoHookean, ClampElement, CubicSpline, Fp64, LeftOf<DefaultSpace>, true>>();
}

}  // namespace
}  // namespace taut::test
