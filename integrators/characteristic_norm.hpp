// The stopping rule of HOT (Zhu et al. 2018; Wang et al. 2020, section 6): residuals are measured
// by the force that a deformation of the size of an element would meet at their unknown,
//
//   (1/n) sum_i |f_i|^2 / F_i^2 < tolerance^2,      f = -g / h^2,
//
// with F_i the characteristic force that terms tell (term.hpp): for grid nodes 24 dx^2 xi_i, and
// xi_i the mean of |d2Psi/dF2 at F = I| over the mass of the particles that they see.
//
// Equal norms are not equal errors: at a tolerance of 1e-7 errors were seen to differ by 1000
// between scenes, for F is a mean, and large where stiff meets soft. DecrementWindow measures the
// error.
#pragma once

#include <taut/integrators/fields.hpp>
#include <taut/integrators/stopping.hpp>

namespace taut {

/// `E` knows characteristic forces.
template <class E>
concept CharacteristicObjective = Objective<E> &&
    requires(E& e, Array<double, typename E::Space> const& force) {
  {e.characteristic_force(force)};
};

namespace kernels {

template <class P, class S>
struct CharacteristicResidual {
  VectorField<typename P::real, S> g;
  Array<double, S> force;
  double per_h2;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sum) const {
    double const unit = force(i);
    if (!(unit > 0)) return;
    auto const f = (per_h2 / unit) * load3<double>(g, i);
    sum[0] += dot(f, f);
  }
};

template <class S>
struct LargestForce {
  Array<double, S> force;
  KOKKOS_FUNCTION void operator()(int i, double& most) const { most = Kokkos::max(most, force(i)); }
};

}  // namespace kernels

/// The largest characteristic force of an unknown, N.
template <CharacteristicObjective E>
double largest_characteristic_force(E& e) {
  using S = typename E::Space;
  Array<double, S> const force("characteristic_force", e.size());
  e.characteristic_force(force);
  return maximum<S>("characteristic_force", e.size(), 0.0, kernels::LargestForce<S>{force});
}

template <class S = DefaultSpace>
class CharacteristicNorm : public ErrorEstimate {
public:
  struct Params {
    double tolerance = 1e-7;
    int window = 8;  ///< steps of the error estimate, at least
  };
  CharacteristicNorm() : CharacteristicNorm(Params()) {}
  explicit CharacteristicNorm(Params const& params)
      : ErrorEstimate(params.window), params_(params) {}

  void start(Scale const& scale) {
    ErrorEstimate::start(scale);
    begun_ = false;
  }
  Stop check(Progress const& progress) {
    add(progress);
    return Stop::none;
  }
  template <class E>
  Stop judge(E& e, VectorField<typename E::Precision::real, S> const& g) {
    static_assert(CharacteristicObjective<E>,
                  "taut: CharacteristicNorm wants a potential of which a term knows its "
                  "characteristic force (core/potential/term.hpp)");
    int const n = e.size();
    if (!begun_) {
      force_ = memory_.resize("characteristic_force", n);
      e.characteristic_force(force_);
      reducer_.provide(n, 1);
      begun_ = true;
    }
    using Residual = kernels::CharacteristicResidual<typename E::Precision, S>;
    double const per_h2 = 1 / (scale_.time_step * scale_.time_step);
    double const sum =
        reducer_.template sum<1>("characteristic_norm", n, Residual{g, force_, per_h2})[0];
    norm_ = std::sqrt(sum / n);
    return norm_ < params_.tolerance ? Stop::converged_by_gradient : Stop::none;
  }
  /// What was found last.
  double norm() const { return norm_; }

private:
  Params params_;
  bool begun_ = false;
  double norm_ = std::numeric_limits<double>::infinity();
  Array<double, S> force_;
  Resizable<Array<double, S>> memory_;
  Reducer<S> reducer_;
};

}  // namespace taut
