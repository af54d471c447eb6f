// A sparse direct solver as the linear solver of a minimiser: exact and serial, for small scenes
// and as an oracle.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/sparse/direct_solver.hpp>
#include <taut/integrators/linear_solver.hpp>

#include <vector>

namespace taut {

template <class P = Mixed, class S = DefaultSpace>
class Direct {
public:
  using Vectors = VectorField<typename P::real, S>;

  struct Params {};
  explicit Direct(Params const& = {}) {}

  template <class E>
  void start(E& e) {
    matrix_.forget();
    host_ = typename Vectors::HostMirror("direct_host", e.size());
    numbers_.resize(3 * std::size_t(e.size()));
  }

  /// Exact whatever the tolerance. Fails (p is then not written) where H is not positive definite.
  template <class E, class M>
  LinearReport solve(E& e, VectorField<typename P::position, S> const& x, Vectors const& b,
                     M const&, LinearTolerance const&, Vectors const& p) {
    if (solver_.factorize(matrix_.at(e, x)) != Definiteness::positive) return {};
    int const n = static_cast<int>(b.extent(0));
    assign(host_, b);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) numbers_[3 * i + c] = double(host_(i, c));
    solver_.solve(numbers_, numbers_);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) host_(i, c) = typename P::real(numbers_[3 * i + c]);
    assign(p, host_);
    return {.stop = LinearStop::converged, .iterations = 1, .residual = 0};
  }

private:
  HessianMatrix<P, S> matrix_;
  typename Vectors::HostMirror host_;
  std::vector<double> numbers_;
  DirectSolver solver_;
};

}  // namespace taut
