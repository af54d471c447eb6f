// The sparse direct solver against Gaussian elimination.
#include "samples.hpp"

#include <taut/core/report/error.hpp>
#include <taut/core/sparse/direct_solver.hpp>
#include <taut/core/sparse/eigen.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

namespace {

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;

std::vector<double> solution(DirectSolver const& solver, std::vector<double> const& b) {
  std::vector<double> x(b.size());
  solver.solve(b, x);
  return x;
}

}  // namespace

TEST_CASE("the conversion to Eigen keeps every entry") {
  auto const a = lattice_matrix<SerialSpace>(3, 1.0);
  a.block(a.find(1, 0))(2, 1) = 42;  // not symmetric: rows and columns must not be confused
  Eigen::SparseMatrix<double> const converted = to_eigen(a);
  REQUIRE(converted.nonZeros() == 9 * static_cast<Eigen::Index>(a.block.extent(0)));
  for (int i = 0; i < a.rows(); ++i)
    for (int k = a.row_begin(i); k < a.row_begin(i + 1); ++k)
      for (int m = 0; m < 9; ++m)
        CHECK(converted.coeff(3 * i + m % 3, 3 * a.column(k) + m / 3) == a.block(k).a[m]);
}

TEST_CASE("direct solves equal dense solves") {
  auto const a = lattice_matrix<DefaultSpace>(4, 0.01);
  std::vector<double> const b = numbers(random_field<double, SerialSpace>(a.rows(), 5));
  DirectSolver solver;
  REQUIRE(solver.factorize(a) == Definiteness::positive);
  CHECK(relative_difference(solution(solver, b), dense_solve(dense(host_copy(a)), b)) < 1e-11);
  CHECK(solver.memory() > 9 * sizeof(double) * a.block.extent(0) / 2);

  SECTION("in place") {
    std::vector<double> x = b;
    solver.solve(x, x);
    CHECK(x == solution(solver, b));
  }
  SECTION("again with other values of the same pattern") {
    auto const other = lattice_matrix<DefaultSpace>(4, 3.0);
    REQUIRE(solver.factorize(other) == Definiteness::positive);
    CHECK(relative_difference(solution(solver, b), dense_solve(dense(host_copy(other)), b)) <
          1e-12);
  }
  SECTION("again with another pattern") {
    auto const other = lattice_matrix<DefaultSpace>(3, 1.0);
    std::vector<double> const c = numbers(random_field<double, SerialSpace>(other.rows(), 6));
    REQUIRE(solver.factorize(other) == Definiteness::positive);
    CHECK(relative_difference(solution(solver, c), dense_solve(dense(host_copy(other)), c)) <
          1e-12);
  }
}

TEST_CASE("an indefinite matrix is named, and solved with") {
  auto const a = lattice_matrix<SerialSpace>(3, -1.0);  // translations have eigenvalue -1
  std::vector<double> const b = numbers(random_field<double, SerialSpace>(a.rows(), 5));
  DirectSolver solver;
  REQUIRE(solver.factorize(a) == Definiteness::indefinite);
  CHECK(relative_difference(solution(solver, b), dense_solve(dense(a), b)) < 1e-10);
}

TEST_CASE("a singular matrix is named, and refused") {
  std::vector<double> x(3 * 27, 1.0);
  DirectSolver solver;
  CHECK_THROWS_WITH(solver.solve(x, x), ContainsSubstring("there is no factor"));
  CHECK(solver.factorize(lattice_matrix<SerialSpace>(3, 0.0)) == Definiteness::singular);
  CHECK_THROWS_WITH(solver.solve(x, x), ContainsSubstring("there is no factor"));
  CHECK(solver.factorize(lattice_matrix<SerialSpace>(3, 1.0)) == Definiteness::positive);
  std::vector<double> y(3);
  CHECK_THROWS_WITH(solver.solve(x, y), ContainsSubstring("81 and 3 numbers"));

  auto const not_a_number =
      lattice_matrix<SerialSpace>(3, std::numeric_limits<double>::quiet_NaN());
  CHECK(solver.factorize(not_a_number) == Definiteness::singular);
}
