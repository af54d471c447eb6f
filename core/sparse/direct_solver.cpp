#include <taut/core/report/error.hpp>
#include <taut/core/sparse/direct_solver.hpp>
#include <taut/core/sparse/eigen.hpp>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace taut {

struct DirectSolver::Factor {
  using Matrix = Eigen::SparseMatrix<double>;

  Eigen::SimplicialLDLT<Matrix> ldlt;
  std::vector<int> outer, inner;  ///< the pattern that was analysed
  bool usable = false;
  mutable std::vector<double> work;

  void analyze(Matrix const& a) {
    std::span const a_outer(a.outerIndexPtr(), a.outerSize() + 1);
    std::span const a_inner(a.innerIndexPtr(), a.nonZeros());
    if (std::ranges::equal(a_outer, outer) && std::ranges::equal(a_inner, inner)) return;
    ldlt.analyzePattern(a);
    outer.assign(a_outer.begin(), a_outer.end());
    inner.assign(a_inner.begin(), a_inner.end());
    work.resize(a.rows());
  }

  /// In exact arithmetic the pivots of a positive definite matrix lie in (0, a_ii]; those that are
  /// smaller by n round-offs are noise.
  Definiteness definiteness(Matrix const& a) const {
    if (ldlt.info() != Eigen::Success) return Definiteness::singular;
    Eigen::VectorXd const diagonal = ldlt.permutationP() * Eigen::VectorXd(a.diagonal());
    double const round_off = std::numeric_limits<double>::epsilon() * double(a.rows());
    bool negative = false;
    for (Eigen::Index i = 0; i < a.rows(); ++i) {
      double const pivot = ldlt.vectorD()(i);
      if (!(std::abs(pivot) > round_off * std::abs(diagonal(i)))) return Definiteness::singular;
      negative = negative || pivot < 0;
    }
    return negative ? Definiteness::indefinite : Definiteness::positive;
  }
};

DirectSolver::DirectSolver() : factor_(std::make_unique<Factor>()) {}
DirectSolver::~DirectSolver() = default;
DirectSolver::DirectSolver(DirectSolver&&) noexcept = default;
DirectSolver& DirectSolver::operator=(DirectSolver&&) noexcept = default;

Definiteness DirectSolver::factorize(BlockCsr<SerialSpace, double> const& a) {
  Factor::Matrix const matrix = to_eigen(a);
  factor_->analyze(matrix);
  factor_->ldlt.factorize(matrix);
  Definiteness const result = factor_->definiteness(matrix);
  factor_->usable = result != Definiteness::singular;
  return result;
}

// Eigen's own solve makes temporaries, and preconditioners must not allocate; hence the plain
// loops.
void DirectSolver::solve(std::span<double const> b, std::span<double> x) const {
  auto const& ldlt = factor_->ldlt;
  std::size_t const n = factor_->work.size();
  if (!factor_->usable) {
    throw Error(
        "direct solver: there is no factor; check that factorize() did not return singular");
  }
  if (b.size() != n || x.size() != n) {
    throw Error("direct solver: vectors of {} and {} numbers do not fit a matrix of {} rows",
                b.size(), x.size(), n);
  }
  auto const& l = ldlt.matrixL().nestedExpression();  // by columns, without the unit diagonal
  int const* const begin = l.outerIndexPtr();
  int const* const row = l.innerIndexPtr();
  double const* const value = l.valuePtr();
  int const* const position = ldlt.permutationP().indices().data();
  std::vector<double>& y = factor_->work;

  for (std::size_t i = 0; i < n; ++i) y[position[i]] = b[i];
  for (std::size_t j = 0; j < n; ++j)
    for (int k = begin[j]; k < begin[j + 1]; ++k) y[row[k]] -= value[k] * y[j];
  for (std::size_t j = 0; j < n; ++j) y[j] /= ldlt.vectorD()(j);
  for (std::size_t j = n; j-- > 0;)
    for (int k = begin[j]; k < begin[j + 1]; ++k) y[j] -= value[k] * y[row[k]];
  for (std::size_t i = 0; i < n; ++i) x[i] = y[position[i]];
}

std::size_t DirectSolver::memory() const {
  if (!factor_->usable) return 0;
  std::size_t const nonzeros = factor_->ldlt.matrixL().nestedExpression().nonZeros();
  std::size_t const pattern = factor_->outer.size() + factor_->inner.size();
  return nonzeros * (sizeof(double) + sizeof(int)) + pattern * sizeof(int) +
         factor_->work.size() * (2 * sizeof(double) + 2 * sizeof(int));
}

}  // namespace taut
