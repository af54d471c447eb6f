// A cycle with the quadratic embedding.
#include "cycle_oracle.hpp"

namespace {

using namespace taut;
using namespace taut::test;

using Fine = MatrixLevel<Right, double, 2>;

}  // namespace

TEST_CASE("a cycle with quadratic embedding is its definition", "[multigrid]") {
  check_two_levels(Multigrid<Fine, ForwardBackward, ForwardBackward, QuadraticEmbedding, double>(
                       {.direct_nodes = 1000}),
                   ForwardBackward(), QuadraticEmbedding());
}
