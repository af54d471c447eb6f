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

/// b' D^-1 b. `reducer` is for as many unknowns.
template <LevelOperator A, class T, class S>
double jacobi_form(A const& a, VectorField<T, S> const& b, Reducer<S> const& reducer) {
  return reducer.template sum<1>("jacobi_form", a.size(),
                                 kernels::JacobiForm<S, T>{a.inverse(), b})[0];
}

/// How far conjugate gradients on a level go.
struct LevelPcgLimits {
  double enough = 0;       ///< until r' D^-1 r is below this
  int max_iterations = 1;  ///< at most
  bool conjugate = true;   ///< off: steepest descent in the metric of D
};

/// Goes on solving A x = b from an x with the residual r, perhaps not at all; returns the number of
/// iterations, and leaves r. Uses the vectors d and y.
template <LevelOperator A, class T, class S>
int continue_pcg(A const& a, LevelVectors<T, S> const& v, LevelPcgLimits const& limits) {
  int const n = a.size();
  kernels::PcgStep<S, T> step{v.b, v.x, v.r, v.d, T(0), false};
  kernels::LanczosResidual<S, T> residual{a.inverse(), v.r, v.y, T(0)};
  double rho = v.reducer.template sum<1>("level_pcg_residual", n, residual)[0], beta = 0;
  int k = 0;
  for (; k < limits.max_iterations && rho >= limits.enough && rho > 0; ++k) {
    for_each<S>("level_pcg_direction", n, kernels::LanczosDirection<S, T>{v.y, v.d, T(beta)});
    a.product(v.d, v.y);
    double const form =
        v.reducer.template sum<1>("level_pcg_form", n, kernels::VectorDot<S, T>{v.d, v.y})[0];
    if (!(form > 0)) break;  // round-off is all that is left
    step.alpha = residual.alpha = T(rho / form);
    for_each<S>("level_pcg_step", n, step);
    double const next = v.reducer.template sum<1>("level_pcg_residual", n, residual)[0];
    beta = limits.conjugate ? next / rho : 0;
    rho = next;
  }
  return k;
}

/// The same from nothing.
template <LevelOperator A, class T, class S>
int solve_by_pcg(A const& a, LevelVectors<T, S> const& v, LevelPcgLimits const& limits) {
  for_each<S>("level_pcg_start", a.size(), kernels::PcgStep<S, T>{v.b, v.x, v.r, v.d, T(0), true});
  return continue_pcg(a, v, limits);
}

}  // namespace taut
