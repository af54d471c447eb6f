// Dense inverses against Eigen's, and of matrices that have none.
#include <Eigen/Dense>
#include <catch2/catch_test_macros.hpp>
#include <taut/core/sparse/dense_inverse.hpp>

#include <cmath>
#include <limits>

namespace {

using namespace taut;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Matrix random_positive(int n, int rank) {
  std::srand(1);
  Matrix const g = Matrix::Random(n, rank);
  return g * g.transpose();
}

double invert(Matrix& a, double round_off = 1e-14) {
  std::vector<double> numbers(a.data(), a.data() + a.size());
  double const shift = invert_positive(numbers, static_cast<int>(a.rows()), round_off);
  std::copy(numbers.begin(), numbers.end(), a.data());
  return shift;
}

}  // namespace

TEST_CASE("the inverse of a positive definite matrix", "[dense_inverse]") {
  for (int n : {1, 3, 60}) {
    Matrix const a = random_positive(n, 2 * n);
    Matrix found = a;
    CHECK(invert(found) == 0);
    CHECK((found * a - Matrix::Identity(n, n)).norm() < 1e-11);
    CHECK(found == Matrix(found.transpose()));
  }
}

TEST_CASE("of a singular matrix it solves what can be solved", "[dense_inverse]") {
  Matrix const a = random_positive(30, 21);
  Matrix found = a;
  CHECK(invert(found) == 0);
  CHECK((a * found * a - a).norm() < 1e-10 * a.norm());
  CHECK(found == Matrix(found.transpose()));
  Matrix none = Matrix::Zero(6, 6);
  CHECK(invert(none) == 0);
  CHECK(none.norm() == 0);
}

TEST_CASE("a matrix that rounding has made indefinite is shifted", "[dense_inverse]") {
  // A free chain, with what fp32 does to a diagonal.
  int const n = 12;
  Matrix a = Matrix::Zero(n, n);
  for (int i = 0; i + 1 < n; ++i) {
    a(i, i) += 1;
    a(i + 1, i + 1) += 1;
    a(i, i + 1) = a(i + 1, i) = -1;
  }
  a.diagonal() *= 1 - 1e-6;
  Matrix found = a;
  double const shift = invert(found, 1e-7);
  CHECK(shift > 1e-7);
  CHECK(shift < 1e-5);
  Matrix shifted = a;
  shifted.diagonal() *= 1 + shift;
  CHECK((found * shifted - Matrix::Identity(n, n)).norm() < 1e-6);
}

TEST_CASE("rows without a diagonal are cut off, and nothing is endless", "[dense_inverse]") {
  Matrix a = random_positive(6, 12);
  a.row(2).setZero();
  a.col(2).setZero();
  a(4, 4) = std::numeric_limits<double>::quiet_NaN();
  Matrix found = a;
  invert(found);
  CHECK(found.allFinite());
  CHECK(found.row(2).norm() + found.col(2).norm() == 0);
  CHECK(found.row(4).norm() + found.col(4).norm() == 0);
  Matrix bad = random_positive(6, 12);
  bad(1, 3) = bad(3, 1) = std::numeric_limits<double>::quiet_NaN();
  invert(bad);
  CHECK(bad.allFinite());
}
