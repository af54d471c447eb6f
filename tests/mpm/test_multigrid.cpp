// Cycles against their definition with dense matrices.
#include "cycle_oracle.hpp"

namespace {

using namespace taut;
using namespace taut::test;

using Fine = MatrixLevel<Right, double, 2>;
using Cycle = Multigrid<Fine, ForwardBackward, ForwardBackward, LinearEmbedding, double>;

}  // namespace

TEST_CASE("a cycle of two levels is its definition", "[multigrid]") {
  check_two_levels(Cycle({.direct_nodes = 1000}), ForwardBackward(), LinearEmbedding());
}

TEST_CASE("V-cycles, W-cycles and cycles without an exact level are metrics", "[multigrid]") {
  check_deep_cycle(Cycle({.direct_nodes = 10}), 1e-13);
  check_deep_cycle(Cycle({.direct_nodes = 10, .visits = 2}), 1e-13);
  check_deep_cycle(Cycle({.max_levels = 3, .direct_nodes = 1}), 1e-13);
}

TEST_CASE("the coarsest level is solved with a sparse factor as with a dense inverse",
          "[multigrid]") {
  Sample<Case<Right, double, 2>> const s(ragged(4, 7));
  int const n = s.size();
  Cycle dense({.direct_nodes = 1000}), sparse({.direct_nodes = 10, .sparse_nodes = 1000});
  dense.build(s.level);
  sparse.build(s.level);
  REQUIRE(dense.report().nodes.size() == 2);
  CHECK(sparse.report().nodes == dense.report().nodes);
  CHECK(sparse.report().direct);
  CHECK(sparse.report().shift < 1e-12);
  auto const g = random_field<Right, double>(n, 4);
  VectorField<double, Right> const z("z", n), expected("expected", n);
  sparse.apply(g, z);
  dense.apply(g, expected);
  CHECK((flat(z, n) - flat(expected, n)).norm() < 1e-10 * flat(expected, n).norm());
  // Where fixed nodes leave single ones, A_c is singular; a sparse factor needs a shift there.
  check_deep_cycle(Cycle({.direct_nodes = 10, .sparse_nodes = 30}), 1e-9);
}

TEST_CASE("a hierarchy is built anew over other nodes", "[multigrid]") {
  Cycle used({.direct_nodes = 10});
  for (unsigned seed : {3u, 4u, 5u}) {
    Sample<Case<Right, double, 2>> const s(ragged(seed, 10 - static_cast<int>(seed)));
    Cycle fresh({.direct_nodes = 10});
    used.build(s.level);
    fresh.build(s.level);
    CHECK(used.report().nodes == fresh.report().nodes);
    int const n = s.size();
    auto const g = random_field<Right, double>(n, seed);
    VectorField<double, Right> const z("z", n), expected("expected", n);
    used.apply(g, z);
    fresh.apply(g, expected);
    CHECK(flat(z, n) == flat(expected, n));
  }
}
