// What a hierarchy is for: convergence that does not depend on the spacing, nor on the stiffness.
#include <catch2/catch_test_macros.hpp>

#include "elastic_grid.hpp"
#include "support/heap.hpp"
#include "support/threads.hpp"

namespace {

using namespace taut;
using namespace taut::test;

using Fine = MatrixLevel<Right, double, 2>;

template <class Cycle>
auto applier(Cycle const& cycle) {
  return [&cycle](auto const& r, auto const& z) { cycle.apply(r, z); };
}

}  // namespace

TEST_CASE("the convergence factor does not depend on the spacing or the modulus",
          "[multigrid_convergence]") {
  // From inertia alone (no error is left) to where a step is a static solve.
  for (double young : {1e4, 1e7, 1e10}) {
    for (int cells : {6, 12, 24}) {
      if (cells == 24 && young != 1e10) continue;
      CAPTURE(cells, young);
      ElasticBox<Right, double> const problem(cells, true, [&](Place const&) { return young; });
      Multigrid<Fine> cycle;
      cycle.build(problem.level);
      CHECK(cycle.report().direct);
      CHECK(cycle.report().shift == 0);
      CHECK(cycle.report().nodes.back() <= 60);
      CHECK(convergence_factor(problem.level, applier(cycle), 8) < 0.45);
    }
  }
}

TEST_CASE("jumps of the modulus cost little", "[multigrid_convergence]") {
  std::vector<int> iterations;
  for (double jump : {1.0, 1e3, 1e6}) {
    ElasticBox<Right, double> const problem(
        16, true, [&](Place const& c) { return 1e5 * (c[0] >= 6 && c[0] < 10 ? jump : 1); });
    Multigrid<Fine> cycle;
    cycle.build(problem.level);
    iterations.push_back(pcg_iterations(problem.level, applier(cycle), 1e-6));
  }
  CAPTURE(iterations[0], iterations[1], iterations[2]);
  CHECK(iterations[0] <= 8);
  CHECK(iterations[2] <= 2 * iterations[0]);
}

TEST_CASE(
    "a free body far stiffer than its inertia: rounding of the hierarchy costs iterations, not "
    "the answer",
    "[multigrid_convergence]") {
  // Steel at 1/24 s: inertia is 1e-9 of the diagonal of H, below the round-off of fp32.
  ElasticBox<Right, double> const problem(
      8, false, [](Place const&) { return 2e11; }, 0.08);
  auto const iterations = [&](auto cycle) {
    cycle.build(problem.level);
    CHECK(cycle.report().direct);
    return std::pair(pcg_iterations(problem.level, applier(cycle), 1e-6), cycle.report().shift);
  };
  auto const [in_double, no_shift] =
      iterations(Multigrid<Fine, ForwardBackward, ForwardBackward, LinearEmbedding, double>());
  auto const [in_float, shift] = iterations(Multigrid<Fine>());
  CAPTURE(in_double, in_float, shift);
  CHECK(no_shift == 0);
  CHECK(in_double <= 10);
  CHECK(in_float <= 40);
}

TEST_CASE("a cycle is bitwise the same on any number of threads, and allocates nothing",
          "[multigrid]") {
  Sample<Case<Right, double, 2>> const s(ragged(9));
  int const n = s.size();
  auto const g = random_field<Right, float>(n, 4);
  VectorField<float, Right> const z("z", n);
  auto const results = test::on_one_thread_and_all([&] {
    Multigrid<Fine> cycle({.direct_nodes = 10, .visits = 2});
    cycle.build(s.level);
    cycle.apply(g, z);
    long const before = heap_allocations;
    cycle.apply(g, z);
    CHECK(heap_allocations == before);
    return std::vector<float>(z.data(), z.data() + 3 * n);
  });
  CHECK(results[0] == results[1]);
}
