// Matrices over grid nodes and their smoothers against dense matrices.
#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <taut/mpm/smoother.hpp>

#include "grid_samples.hpp"

namespace {

using namespace taut;
using namespace taut::test;

/// The nodes in the order in which Gauss-Seidel comes to them: colours of blocks of 4^3, blocks,
/// places.
template <class S>
std::vector<int> sweep_order(GridNodes<S> const& nodes) {
  std::vector<std::array<int, 8>> keys;
  for (int i = 0; i < nodes.count; ++i) {
    auto const [x, y, z] = place(nodes, i);
    int const colour = (x >> 2 & 1) * 4 + (y >> 2 & 1) * 2 + (z >> 2 & 1);
    keys.push_back({colour, x >> 2, y >> 2, z >> 2, x, y, z, i});
  }
  std::sort(keys.begin(), keys.end());
  std::vector<int> order;
  for (auto const& key : keys) order.push_back(key[7]);
  return order;
}

/// Splits A into the parts before, on and after the block diagonal in the order of a sweep.
struct Split {
  Dense lower, diagonal, upper;
  Split(Dense const& a, std::vector<int> const& order)
      : lower(Dense::Zero(a.rows(), a.cols())), diagonal(lower), upper(lower) {
    std::vector<int> rank(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) rank[order[k]] = static_cast<int>(k);
    for (int i = 0; i < a.rows(); ++i)
      for (int j = 0; j < a.cols(); ++j) {
        Dense& to = rank[j / 3] < rank[i / 3] ? lower : i / 3 == j / 3 ? diagonal : upper;
        to(i, j) = a(i, j);
      }
  }
};

}  // namespace

TEMPLATE_TEST_CASE("products, sweeps and diagonals are those of the dense matrix", "[grid_matrix]",
                   (Case<Right, double, 2>), (Case<Left, float, 3>), (Case<Right, double, 1>)) {
  using S = typename TestType::S;
  using T = typename TestType::Real;
  Sample<TestType> const s(ragged(1, TestType::radius == 3 ? 7 : 9));
  int const n = s.size();
  double const close = (std::is_same_v<T, float> ? 3e-6 : 1e-14);
  CHECK((dense(s.level.matrix()) - s.matrix).norm() <= close * s.matrix.norm());

  LevelVectors<T, S> v;
  v.resize(n);
  assign(Kokkos::subview(v.b, Kokkos::make_pair(0, n), Kokkos::ALL), random_field<S, T>(n, 5));
  Eigen::VectorXd const b = flat(v.b, n);

  auto const x = random_field<S, T>(n, 6);
  s.level.product(x, v.y);
  CHECK(difference(v.y, s.matrix * flat(x, n)) < close);
  s.level.residual(v.b, x, v.r);
  CHECK(difference(v.r, b - s.matrix * flat(x, n)) < close);

  Split const split(s.matrix, sweep_order(s.grid.nodes()));
  Dense const forward = split.diagonal + split.lower, backward = split.diagonal + split.upper;
  Eigen::VectorXd const y = solve(forward, b);
  ForwardBackward const pair;
  pair.first(s.level, v);
  CHECK(difference(v.x, y) < close);
  CHECK(difference(v.r, b - s.matrix * y) < close);
  pair.second(s.level, v);
  Eigen::VectorXd const z = y + solve(backward, b - s.matrix * y);
  CHECK(difference(v.x, z) < close);

  SymmetricGaussSeidel const symmetric;
  symmetric.first(s.level, v);
  Eigen::VectorXd const u = solve(backward, split.diagonal * y);
  CHECK(difference(v.x, u) < close);
  CHECK((flat(v.r, n) - (b - s.matrix * u)).norm() < close * b.norm());
  symmetric.second(s.level, v);
  Eigen::VectorXd const r = b - s.matrix * u;
  Eigen::VectorXd const w = u + solve(backward, split.diagonal * solve(forward, r));
  CHECK(difference(v.x, w) < close);
}

TEST_CASE("assembled matrices are copied, or refused", "[grid_matrix]") {
  GridLevel<Right> grid;
  grid.assign(leaf_list({{0, 0, 0}, {0, 0, 1}, {0, 3, 0}}), 1);
  BlockPattern const pattern{{0, 2, 4, 5}, {0, 1, 0, 1, 2}};
  BlockCsr<Right> csr(pattern);
  for (int k = 0; k < 5; ++k)
    for (int m = 0; m < 9; ++m) csr.block(k).a[m] = 10 * k + m;
  GridMatrix<Right, double, 2> a;
  a.resize(grid.nodes());
  // Row i belongs to node i, whatever its place.
  copy(csr, a);
  Dense const d = dense(a);
  for (int i = 0; i < 3; ++i)
    for (int k = pattern.row_begin[i]; k < pattern.row_begin[i + 1]; ++k)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
          CHECK(d(3 * i + r, 3 * pattern.column[k] + c) == csr.block(k)(r, c));
  BlockPattern const far{{0, 3, 4, 5}, {0, 1, 2, 1, 2}};
  CHECK_THROWS_AS(copy(BlockCsr<Right>(far), a), Error);
  BlockPattern const short_one{{0, 1}, {0}};
  CHECK_THROWS_AS(copy(BlockCsr<Right>(short_one), a), Error);
}
