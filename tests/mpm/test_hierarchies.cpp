// Hierarchies over small, scattered and fixed grids; and of Jacobi's method.
#include "cycle_oracle.hpp"

namespace {

using namespace taut;
using namespace taut::test;

using Fine = MatrixLevel<Right, double, 2>;

}  // namespace

TEST_CASE("a Jacobi cycle is symmetric too", "[multigrid]") {
  Sample<Case<Right, double, 2>> const s(reached(6));
  Multigrid<Fine, DampedJacobi, DampedJacobi, LinearEmbedding, double> cycle(
      {.direct_nodes = 10,
       .fine = {.damping = 0, .sweeps = 2},
       .smoother = {.damping = 0, .sweeps = 2}});
  cycle.build(s.level);
  check_metric(matrix_of(cycle, s.level), dense(s.level.matrix()), 1e-13);
}

TEST_CASE("hierarchies over small, scattered and fixed grids", "[multigrid]") {
  Multigrid<Fine> cycle;
  auto const built = [&](std::set<Place> const& places, std::vector<std::uint8_t> const& fixed,
                         std::vector<int> const& nodes) {
    Sample<Case<Right, double, 2>> const s(places, fixed);
    cycle.build(s.level);
    CHECK(cycle.report().nodes == nodes);
    if (places.empty()) return Dense();
    return Dense(matrix_of(cycle, s.level) * dense(s.level.matrix()));
  };
  built({}, {}, {0});
  // One node: the smoother alone is exact.
  Dense const one = built({{-1, 4, 1}}, {}, {1, 4});
  CHECK((one - Dense::Identity(3, 3)).norm() < 1e-6);
  // All fixed: D^-1, twice.
  Dense const held = built(box({0, 0, 0}, {2, 1, 0}), {1, 1, 1, 1, 1, 1}, {6});
  CHECK((held - Dense::Identity(18, 18)).norm() < 1e-6);
  // Crumbs so far apart that coarsening never joins them: the cycle smooths them instead.
  std::set<Place> far;
  for (int x : {-1, 1})
    for (int y : {-1, 1})
      for (Place const& p : box({0, 0, 0}, {2, 2, 2})) {
        far.insert({p[0] + x * (1 << 28), p[1] + y * (1 << 28), p[2] + 16});
      }
  Sample<Case<Right, double, 2>> const s(far);
  Multigrid<Fine> smoothed({.direct_nodes = 20});
  smoothed.build(s.level);
  CHECK_FALSE(smoothed.report().direct);
  CHECK(smoothed.report().nodes == std::vector{108, 32});
  Dense const m = matrix_of(smoothed, s.level);
  check_metric(m, dense(s.level.matrix()), 1e-5);
}
