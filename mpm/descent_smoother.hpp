// Smoothers that find their step lengths themselves, and so need no bound of the spectrum:
// conjugate gradients with block Jacobi (an iteration or a few), or steepest descent in the metric
// of D, which is Jacobi's method with the damping that is best for the residual,
//
//   x += a D^-1 r,   a = r'D^-1 r / (D^-1 r)'A (D^-1 r)
//
// ("optimal Jacobi" in HOT's code). What they do depends on the residual, so a cycle with them is
// no fixed operator: of use as a solver, in L-BFGS, or inside flexible conjugate gradients.
#pragma once

#include <taut/mpm/level_pcg.hpp>

namespace taut {

struct DescentSmoother {
  static constexpr char const* name = "pcg";
  struct Params {
    int iterations = 1;
    bool conjugate = true;  ///< off: steepest descent
  };
  DescentSmoother() : DescentSmoother(Params()) {}
  explicit DescentSmoother(Params const& params) : params_(params) {}

  template <class A, class V>
  void setup(A const&, V&) {}

  template <class A, class T, class S>
  void first(A const& a, LevelVectors<T, S> const& v) const {
    solve_by_pcg(a, v, limits());
  }
  template <class A, class T, class S>
  void second(A const& a, LevelVectors<T, S> const& v) const {
    a.residual(v.b, v.x, v.r);
    continue_pcg(a, v, limits());
  }

private:
  LevelPcgLimits limits() const { return {0, params_.iterations, params_.conjugate}; }

  Params params_;
};

}  // namespace taut
