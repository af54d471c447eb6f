// The stopping rule of Gast et al. 2015 (as Wang et al. 2020, section 6, compare with it): what is
// left of the residual of momentum, in the norm of all unknowns together,
//
//   |g / h|_2 < tolerance,    kg m/s.
//
// It knows neither masses nor stiffness, so each scene needs a tolerance of its own (1e-3 in all of
// theirs, between 1e-3 and 1e2 what would have done).
#pragma once

#include <taut/integrators/fields.hpp>
#include <taut/integrators/stopping.hpp>

#include <cmath>

namespace taut {

namespace kernels {

template <class P, class S>
struct SquareOfGradient {
  VectorField<typename P::real, S> g;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sum) const {
    auto const own = load3<double>(g, i);
    sum[0] += dot(own, own);
  }
};

}  // namespace kernels

template <class S = DefaultSpace>
class MomentumNorm : public ErrorEstimate {
public:
  struct Params {
    double tolerance = 1e-3;  ///< kg m/s
    int window = 8;           ///< steps of the error estimate, at least
  };
  MomentumNorm() : MomentumNorm(Params()) {}
  explicit MomentumNorm(Params const& params) : ErrorEstimate(params.window), params_(params) {}

  Stop check(Progress const& progress) {
    add(progress);
    return Stop::none;
  }
  template <class E>
  Stop judge(E& e, VectorField<typename E::Precision::real, S> const& g) {
    using Square = kernels::SquareOfGradient<typename E::Precision, S>;
    reducer_.provide(e.size(), 1);
    double const square = reducer_.template sum<1>("momentum_norm", e.size(), Square{g})[0];
    norm_ = std::sqrt(square) / scale_.time_step;
    return norm_ < params_.tolerance ? Stop::converged_by_gradient : Stop::none;
  }
  /// What was found last, kg m/s.
  double norm() const { return norm_; }

private:
  Params params_;
  double norm_ = std::numeric_limits<double>::infinity();
  Reducer<S> reducer_;
};

}  // namespace taut
