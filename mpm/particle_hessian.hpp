// The Hessian of particles at an iterate, for linear solvers (Pcg in integrators/linear_solver.hpp)
// and for InverseByPcg: as a matrix over the grid, or without one as the numbers of a
// ParticleOperator, which a product reads instead of decomposing F anew.
#pragma once

#include <taut/mpm/level_operator.hpp>
#include <taut/mpm/particle_operator.hpp>

namespace taut {

template <class P, class S, bool assembled, Spline K = QuadraticSpline>
class ParticleHessian {
public:
  using Real = typename P::real;
  using Vectors = VectorField<Real, S>;

  template <class E>
  void start(E& e) {
    local_ = memory_.resize("node_curvature", e.size());
  }
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const& x) {
    operator_.linearise(e, x, local_);
    if constexpr (assembled) {
      matrix_.resize(operator_.nodes());
      operator_.matrix(matrix_);
    }
  }
  /// hd = H d
  void product(Vectors const& d, Vectors const& hd) const {
    if constexpr (assembled) {
      taut::product(matrix_, d, hd);
    } else {
      operator_.product(d, hd);
    }
  }
  template <class E>
  void product(E&, VectorField<typename P::position, S> const&, Vectors const& d,
               Vectors const& hd) const {
    product(d, hd);
  }

private:
  ParticleOperator<K, Real, S> operator_;
  GridMatrix<S, Real, K::width - 1> matrix_;
  BlockField<Real, S> local_;
  Resizable<BlockField<Real, S>> memory_;
};

}  // namespace taut
