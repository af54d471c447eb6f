// A cycle of other smoothers, in fp32.
#include "cycle_oracle.hpp"

namespace {

using namespace taut;
using namespace taut::test;

using Fine = MatrixLevel<Right, double, 2>;

}  // namespace

TEST_CASE("a cycle of symmetric Gauss-Seidel and Chebyshev in fp32 is a metric", "[multigrid]") {
  check_deep_cycle(Multigrid<Fine, SymmetricGaussSeidel, Chebyshev>({.direct_nodes = 10}), 1e-5);
}
