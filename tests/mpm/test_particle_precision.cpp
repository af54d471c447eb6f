// The elastic term over particles against plain loops over all nodes, in mixed precision and as a
// device runs it.
#include <taut/materials/models.hpp>

#include "particle_problem.hpp"

#include <catch2/catch_test_macros.hpp>

namespace taut::test {
namespace {

TEST_CASE("sweeps over particles in mixed precision are the sums over all nodes",
          "[mpm][particles]") {
  check_sweeps<
      Combination<NeoHookean, ClampElement, QuadraticSpline, Mixed, RightOf<DefaultSpace>, true>>();
}

TEST_CASE("teams of threads with a particle each sum over all nodes", "[mpm][particles]") {
  check_sweeps<Combination<FixedCorotated, FullProjection, QuadraticSpline, Mixed,
                           LeftOf<DefaultSpace>, false>>();
}

}  // namespace
}  // namespace taut::test
