// Eigenvalues of tridiagonal matrices, against Eigen's.
#include <taut/core/sparse/ritz_value.hpp>

#include <Eigen/Eigenvalues>
#include <catch2/catch_test_macros.hpp>

#include <cmath>
#include <random>

using namespace taut;

TEST_CASE("the largest eigenvalue of a tridiagonal matrix") {
  CHECK(largest_tridiagonal({3}, {}) == 3);
  // 2 - 2 cos(k pi / (n + 1))
  std::vector<double> const diagonal(50, 2), beside(49, -1);
  CHECK(std::abs(largest_tridiagonal(diagonal, beside) - (2 - 2 * std::cos(50 * M_PI / 51))) <
        1e-13);
  CHECK(largest_tridiagonal({1, 5, 2}, {0, 0}) == 5);
}

TEST_CASE("the residual of a Ritz value is that of its vector") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(0.5, 2);
  for (int n = 1; n <= 12; ++n) {
    std::vector<double> diagonal(n), beside(n);
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + 1, n + 1);
    for (int i = 0; i < n; ++i) {
      diagonal[i] = matrix(i, i) = number(random);
      beside[i] = matrix(i, i + 1) = matrix(i + 1, i) = number(random);
    }
    Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> const eigen(matrix.topLeftCorner(n, n));
    Eigen::VectorXd vector = Eigen::VectorXd::Zero(n + 1);
    vector.head(n) = eigen.eigenvectors().col(n - 1);
    double const largest = eigen.eigenvalues()(n - 1);
    auto const [value, residual] = largest_ritz_value(diagonal, beside);
    CHECK(std::abs(value - largest) < 1e-13 * largest);
    CHECK(std::abs(residual - (matrix * vector - largest * vector).norm()) < 1e-9 * largest);
  }
}

TEST_CASE("conjugate gradients find the largest eigenvalue on their way") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  int const n = 12;
  Eigen::MatrixXd g = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return number(random); });
  Eigen::MatrixXd const a = g * g.transpose() + Eigen::MatrixXd::Identity(n, n);
  double const largest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(a).eigenvalues()(n - 1);
  Eigen::VectorXd r = Eigen::VectorXd::NullaryExpr(n, [&] { return number(random); }), d = r;
  LanczosByConjugates lanczos;
  double before = 0;
  for (int k = 0; k < n; ++k) {
    double const rho = r.squaredNorm(), alpha = rho / d.dot(a * d);
    r -= alpha * (a * d);
    double const beta = r.squaredNorm() / rho;
    d = r + beta * d;
    auto const [value, residual] = lanczos.add(alpha, beta);
    CHECK(value >= before * (1 - 1e-12));
    CHECK(value <= largest * (1 + 1e-12));
    before = value;
    if (k + 1 == n) CHECK(std::abs(value - largest) < 1e-9 * largest);
  }
}
