// Cycles as operators: the dense matrix of what a cycle does, and what it must be.
#pragma once

#include <catch2/catch_test_macros.hpp>
#include <taut/mpm/multigrid.hpp>

#include "grid_samples.hpp"

namespace taut::test {

/// The matrix of a cycle: what it makes of unit vectors.
template <class Cycle, class Fine>
Dense matrix_of(Cycle const& cycle, Fine const& fine) {
  using T = typename Fine::Scalar;
  using S = typename Fine::Space;
  int const n = fine.size();
  Dense m(3 * n, 3 * n);
  VectorField<T, S> g("g", n), z("z", n);
  for (int k = 0; k < 3 * n; ++k) {
    g(k / 3, k % 3) = 1;
    cycle.apply(g, z);
    m.col(k) = flat(z, n);
    g(k / 3, k % 3) = 0;
  }
  return m;
}

/// What every cycle must be: symmetric, positive, and no larger than the inverse.
inline void check_metric(Dense const& cycle, Dense const& a, double round_off) {
  CHECK((cycle - cycle.transpose()).norm() <= round_off * cycle.norm());
  Dense const symmetric = (cycle + cycle.transpose()) / 2;
  Eigen::VectorXd const values = eigenpairs(a, inverse(symmetric)).values;
  CHECK(values.minCoeff() > 0.05);
  CHECK(values.maxCoeff() < 1 + 10 * round_off);
}

/// Fixes every fifth node.
inline std::vector<std::uint8_t> every_fifth(std::size_t count) {
  std::vector<std::uint8_t> fixed(count);
  for (std::size_t i = 0; i < count; ++i) fixed[i] = i % 5 == 0;
  return fixed;
}

/// S of b of a smoother, as a matrix.
template <class Smoother, class Fine>
Dense smoother_of(Smoother const& smoother, Fine const& fine) {
  using T = typename Fine::Scalar;
  using S = typename Fine::Space;
  int const n = fine.size();
  LevelVectors<T, S> v;
  v.resize(n);
  assign(v.b, T(0));
  Dense m(3 * n, 3 * n);
  for (int k = 0; k < 3 * n; ++k) {
    v.b(k / 3, k % 3) = 1;
    smoother.first(fine, v);
    m.col(k) = flat(v.x, n);
    v.b(k / 3, k % 3) = 0;
  }
  return m;
}

/// A cycle of two levels, the second one exact, against its definition
///   x = S b;  x += P (P'AP)^-1 P' (b - A x);  x += S' (b - A x).
/// Single nodes between fixed ones hang on several coarse nodes, so P'AP may be singular.
template <class Cycle, class Smoother, class Embedding>
void check_two_levels(Cycle cycle, Smoother const& smoother, Embedding) {
  auto const places = ragged(3, 5);
  auto const fixed = every_fifth(places.size());
  Sample<Case<Right, double, 2>> const s(places, fixed);
  Dense const a = dense(s.level.matrix());  // fixed nodes cut off
  cycle.build(s.level);
  REQUIRE(cycle.report().nodes.size() == 2);
  REQUIRE(cycle.report().direct);
  CHECK(cycle.report().shift == 0);
  Dense const p = prolongation<Embedding>(s.grid.nodes(), cycle.level(0).nodes(), fixed);
  Dense const coarse = p * pseudo_inverse(p.transpose() * a * p) * p.transpose();
  Dense const first = smoother_of(smoother, s.level);
  Dense const one = Dense::Identity(a.rows(), a.cols());
  Dense x = first;
  x += coarse * (one - a * x);
  x += first.transpose() * (one - a * x);
  Dense const found = matrix_of(cycle, s.level);
  CHECK((found - x).norm() < 1e-11 * x.norm());
  check_metric(found, a, 1e-12);
}

/// A cycle of three levels or more is a metric for the inverse.
template <class Cycle>
void check_deep_cycle(Cycle cycle, double round_off) {
  auto const places = reached(5);
  std::vector<std::uint8_t> fixed;
  for (Place const& p : places) fixed.push_back(p[0] <= -3);
  Sample<Case<Right, double, 2>> const s(places, fixed);
  cycle.build(s.level);
  REQUIRE(cycle.report().nodes.size() >= 3);
  check_metric(matrix_of(cycle, s.level), dense(s.level.matrix()), round_off);
}

}  // namespace taut::test
