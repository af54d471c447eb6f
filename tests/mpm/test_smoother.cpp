// Smoothers that are polynomials, their bounds, and that threads do not matter to any.
#include <Eigen/Core>
#include <catch2/catch_test_macros.hpp>
#include <taut/mpm/smoother.hpp>

#include "grid_samples.hpp"
#include "support/threads.hpp"

namespace {

using namespace taut;
using namespace taut::test;

}  // namespace

TEST_CASE("Jacobi and Chebyshev are polynomials in D^-1 A", "[grid_matrix]") {
  using C = Case<Right, double, 2>;
  Sample<C> const s(ragged(2));
  int const n = s.size();
  LevelVectors<double, Right> v;
  v.resize(n);
  Eigen::VectorXd const b = flat(v.b = random_field<Right, double>(n, 5), n);
  Dense diagonal = Dense::Zero(3 * n, 3 * n);
  for (int i = 0; i < n; ++i)
    diagonal.block(3 * i, 3 * i, 3, 3) = s.matrix.block(3 * i, 3 * i, 3, 3);
  Dense const inverse = test::inverse(diagonal);

  DampedJacobi const jacobi({.damping = 0.4, .sweeps = 3});
  jacobi.first(s.level, v);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(3 * n);
  for (int k = 0; k < 3; ++k) x += 0.4 * inverse * (b - s.matrix * x);
  CHECK(difference(v.x, x) < 1e-13);
  CHECK(difference(v.r, b - s.matrix * x) < 1e-12);
  jacobi.second(s.level, v);
  for (int k = 0; k < 3; ++k) x += 0.4 * inverse * (b - s.matrix * x);
  CHECK(difference(v.x, x) < 1e-13);

  // The error that Chebyshev leaves in an eigenvector is T_k((middle - lambda) / half) over that of
  // lambda = 0.
  Chebyshev chebyshev({.degree = 4});
  chebyshev.setup(s.level, v);
  v.b = random_field<Right, double>(n, 5);
  double const most = chebyshev.largest(), least = most / 30;
  auto const [eigenvalues, eigenvectors] = eigenpairs(s.matrix, diagonal);
  CHECK(eigenvalues.maxCoeff() <= most);
  CHECK(most <= 1.2 * eigenvalues.maxCoeff());
  Eigen::VectorXd const exact = solve_symmetric(s.matrix, b);
  auto const polynomial = [](double t) {
    double before = 1, now = t;
    for (int k = 1; k < 4; ++k) before = std::exchange(now, 2 * t * now - before);
    return now;
  };
  double const middle = (most + least) / 2, half = (most - least) / 2;
  Eigen::VectorXd const coefficients = test::inverse(eigenvectors) * exact;
  Eigen::VectorXd factor(3 * n);
  for (int k = 0; k < 3 * n; ++k) {
    factor(k) = polynomial((middle - eigenvalues(k)) / half) / polynomial(middle / half);
  }
  Eigen::VectorXd const error = eigenvectors * factor.cwiseProduct(coefficients);
  chebyshev.first(s.level, v);
  CHECK((exact - flat(v.x, n) - error).norm() < 1e-12 * exact.norm());
  CHECK(difference(v.r, b - s.matrix * flat(v.x, n)) < 1e-12);
  chebyshev.second(s.level, v);
  Eigen::VectorXd const twice =
      eigenvectors * factor.cwiseProduct(factor).cwiseProduct(coefficients);
  CHECK((exact - flat(v.x, n) - twice).norm() < 1e-12 * exact.norm());
}

TEST_CASE("one block is cut in the same pieces by one thread and by many", "[grid_matrix]") {
  using C = Case<Right, float, 2>;
  Sample<C> const s(ragged(7));
  int const n = s.size();
  auto const results = test::on_one_thread_and_all([&] {
    LevelVectors<float, Right> v;
    v.resize(n);
    v.b = random_field<Right, float>(n, 5);
    Chebyshev chebyshev;
    chebyshev.setup(s.level, v);
    v.b = random_field<Right, float>(n, 5);
    ForwardBackward const pair;
    pair.first(s.level, v);
    pair.second(s.level, v);
    chebyshev.second(s.level, v);
    std::vector<float> values(v.x.data(), v.x.data() + 3 * n);
    values.push_back(float(chebyshev.largest()));
    return values;
  });
  CHECK(results[0] == results[1]);
}
