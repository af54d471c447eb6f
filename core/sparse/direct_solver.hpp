// Sparse direct solve A x = b by P A P' = L D L' with a minimum-degree order P: the oracle of the
// iterative solvers, the Newton direction of small scenes and the coarse level of preconditioners.
// Runs on the host in fp64; serial, so bitwise repeatable.
#pragma once

#include <taut/core/sparse/block_csr.hpp>

#include <cstddef>
#include <memory>
#include <span>

namespace taut {

/// What the signs of the pivots say about a symmetric matrix.
enum class Definiteness {
  positive,
  indefinite,  ///< a negative pivot: A can be solved with, but is no metric
  singular     ///< a pivot lost to round-off: nothing can be solved with
};

class DirectSolver {
public:
  DirectSolver();
  ~DirectSolver();
  DirectSolver(DirectSolver&&) noexcept;
  DirectSolver& operator=(DirectSolver&&) noexcept;

  /// Factors a symmetric A, of which the lower triangle is read. The order and the pattern of L are
  /// kept while the pattern of A stays the same.
  Definiteness factorize(BlockCsr<SerialSpace, double> const& a);
  template <class S>
  Definiteness factorize(BlockCsr<S, double> const& a) {
    return factorize(host_copy(a));
  }

  /// Solves A x = b for 3n numbers, unknown by unknown; b and x may be the same. Allocates
  /// nothing; not for two threads at once.
  /// Throws Error without a factor (before `factorize`, or after one that found A singular) or for
  /// vectors of another length.
  void solve(std::span<double const> b, std::span<double> x) const;

  /// Bytes that the factor takes.
  std::size_t memory() const;

private:
  struct Factor;
  std::unique_ptr<Factor> factor_;
};

}  // namespace taut
