// The Hessian at an iterate as a preconditioner, inverted by conjugate gradients with block Jacobi
// to a rough tolerance: in L-BFGS this is LBFGS-H (Liu et al. 2017; Wang et al. 2020, section 6.1).
// Not a fixed operator, as the number of iterations depends on the right-hand side; L-BFGS bears
// that.
#pragma once

#include <taut/integrators/linear_solver.hpp>

#include <limits>

namespace taut {

/// `Hessian` as in Pcg, with a product that needs no objective.
template <class P = Mixed, class S = DefaultSpace, class Hessian = AssembledHessian<P, S>>
class InverseByPcg {
public:
  using Vectors = VectorField<typename P::real, S>;

  struct Params {
    Refresh refresh = {.interval = std::numeric_limits<int>::max()};  ///< once in a minimisation
    double tolerance = 0.5;  ///< relative residual, in the norm of block Jacobi
    int max_iterations = 10000;
    typename BlockJacobi<P, S>::Params jacobi = {};
  };
  static constexpr char const* name = "inverse_by_pcg";

  InverseByPcg() : InverseByPcg(Params()) {}
  explicit InverseByPcg(Params const& params) : params_(params), jacobi_(params.jacobi) {}

  Refresh refresh() const { return params_.refresh; }
  void resize(int n) {
    jacobi_.resize(n);
    cg_.resize(n);
  }
  LocalMatrices<P, S> const& curvature() const { return jacobi_.curvature(); }
  bool pointwise() const { return false; }

  /// Takes the Hessian at x.
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const& x) {
    jacobi_.update(e, x);
    hessian_.start(e);
    hessian_.update(e, x);
  }
  void apply(Vectors const& g, Vectors const& z) const {
    auto const product = [&](Vectors const& d, Vectors const& hd) { hessian_.product(d, hd); };
    iterations_ +=
        cg_.solve(product, jacobi_, g, params_.tolerance, params_.max_iterations, z).iterations;
  }
  /// Of conjugate gradients, in all.
  int iterations() const { return iterations_; }

private:
  Params params_;
  BlockJacobi<P, S> jacobi_;
  Hessian hessian_;
  ConjugateGradients<P, S> cg_;
  mutable int iterations_ = 0;
};

}  // namespace taut
