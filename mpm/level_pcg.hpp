// Conjugate gradients on a level of a hierarchy, with block Jacobi: a coarse solver for levels that
// are too large to invert, and what HOT takes whatever their size (Wang et al. 2020, section 5).
// How many iterations that takes depends on the right-hand side, so the cycle above it is no fixed
// operator.
#pragma once

#include <taut/mpm/spectrum.hpp>

namespace taut {
namespace kernels {

/// b' D^-1 b
template <class S, class T>
struct JacobiForm {
  BlockField<T, S> inverse;
  VectorField<T, S> b;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sums) const { sums[0] += term(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION double term(int i) const {
    Vec3<T> const own = vector_of<T>(b, i), z = block_times(inverse, i, own);
    return double(own[0]) * double(z[0]) + double(own[1]) * double(z[1]) +
           double(own[2]) * double(z[2]);
  }
};

/// x += alpha d, and first r = b and x = 0 where `start`.
template <class S, class T>
struct PcgStep {
  VectorField<T, S> b, x, r, d;
  T alpha;
  bool start;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) {
      if (start) {
        x(i, c) = 0;
        r(i, c) = b(i, c);
      } else {
        x(i, c) += alpha * d(i, c);
      }
    }
  }
};

}  // namespace kernels

/// b' D^-1 b.
template <LevelOperator A, class T, class S>
double jacobi_form(A const& a, VectorField<T, S> const& b, Reducer<S> const& reducer) {
  return reducer.template sum<1>("jacobi_form", a.size(),
                                 kernels::JacobiForm<S, T>{a.inverse(), b})[0];
}

/// Solves A x = b from nothing until r' D^-1 r is below `enough`, perhaps at once; returns the
/// number of iterations. Uses the vectors r, d and y. `reducer` is for as many unknowns.
template <LevelOperator A, class T, class S>
int solve_by_pcg(A const& a, LevelVectors<T, S> const& v, Reducer<S> const& reducer, double enough,
                 int max_iterations) {
  int const n = a.size();
  kernels::PcgStep<S, T> step{v.b, v.x, v.r, v.d, T(0), true};
  for_each<S>("level_pcg_start", n, step);
  step.start = false;
  kernels::LanczosResidual<S, T> residual{a.inverse(), v.r, v.y, T(0)};
  double rho = reducer.template sum<1>("level_pcg_residual", n, residual)[0], beta = 0;
  int k = 0;
  for (; k < max_iterations && rho >= enough && rho > 0; ++k) {
    for_each<S>("level_pcg_direction", n, kernels::LanczosDirection<S, T>{v.y, v.d, T(beta)});
    a.product(v.d, v.y);
    double const form =
        reducer.template sum<1>("level_pcg_form", n, kernels::VectorDot<S, T>{v.d, v.y})[0];
    if (!(form > 0)) break;  // round-off is all that is left
    step.alpha = residual.alpha = T(rho / form);
    for_each<S>("level_pcg_step", n, step);
    double const next = reducer.template sum<1>("level_pcg_residual", n, residual)[0];
    beta = next / rho;
    rho = next;
  }
  return k;
}

}  // namespace taut
