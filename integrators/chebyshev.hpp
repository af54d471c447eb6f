// Chebyshev semi-iteration for nonlinear problems (Wang and Yang 2016, "Descent methods for elastic
// body simulation on the GPU"):
//   x^_{k+1} = x_k - alpha P g,   x_{k+1} = omega_{k+1} (x^_{k+1} - x_{k-1}) + x_{k-1},
//   omega = 1 for the first S iterations, then 2 / (2 - rho^2), then 4 / (4 - rho^2 omega),
// with alpha the step of the quadratic model along -P g, and rho the spectral radius of I - alpha P
// H. As a displacement this is alpha (omega (-P g) + (omega - 1) / alpha s), s the last
// displacement, so it fits the loop of a descent method: where the energy would rise, the step is
// shortened and the recursion starts anew.
//
// rho may be given, or is measured: by the rate of convergence during the delay, and later, where
// the iteration is slower than rho promises, from the rate lambda of an error component that rho
// does not cover: lambda^2 = omega mu lambda + 1 - omega gives its mu (Young 1971).
#pragma once

#include <taut/core/report/error.hpp>
#include <taut/integrators/descent.hpp>

namespace taut {
namespace kernels {

/// s = length p and then p = -z; sums g'z and g' M^-1 g. On entry p is the last direction and z, P
/// g, is read from `z`.
template <class P, class S>
struct ChebyshevGradient {
  VectorField<typename P::real, S> gradient, z, p, last_step;
  Array<typename P::real, S> mass;
  typename P::real length;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, 2>& sums) const {
    using Real = typename P::real;
    using Sum = typename P::sum;
    store3(last_step, i, length * load3<Real>(p, i));
    auto const zi = load3<Real>(z, i);
    store3(p, i, -zi);
    auto const g = load3<Sum>(gradient, i);
    Sum const gg = dot(g, g);
    sums[0] += dot(g, convert<Sum>(zi));
    if (gg > 0) sums[1] += gg / Sum(mass(i));
  }
};

/// p = omega p + momentum s; sums g'p and p'M p.
template <class P, class S>
struct ChebyshevDirection {
  VectorField<typename P::real, S> gradient, p, last_step;
  Array<typename P::real, S> mass;
  typename P::real omega, momentum;
  KOKKOS_FUNCTION void operator()(int i, Sums<typename P::sum, 2>& sums) const {
    using Real = typename P::real;
    using Sum = typename P::sum;
    auto next = omega * load3<Real>(p, i);
    if (momentum != 0) next = next + momentum * load3<Real>(last_step, i);
    store3(p, i, next);
    auto const wide = convert<Sum>(next);
    sums[0] += dot(load3<Sum>(gradient, i), wide);
    sums[1] += Sum(mass(i)) * dot(wide, wide);
  }
};

}  // namespace kernels

struct ChebyshevParams {
  double rho = 0;  ///< spectral radius, below 1; 0: measured
  int delay = 10;  ///< iterations without acceleration, S
};

/// The directions of the semi-iteration.
template <class P, class S>
class ChebyshevDirections {
public:
  using Precision = P;
  using Space = S;
  using Vectors = VectorField<typename P::real, S>;

  template <class Params>
  explicit ChebyshevDirections(Params const& params) : params_(params.chebyshev) {
    if (!(params_.rho >= 0 && params_.rho < 1) || params_.delay < 2)
      throw Error(
          "chebyshev: rho = {} and delay = {} are out of range; choose rho in [0, 1) and at "
          "least 2 iterations of delay",
          params_.rho, params_.delay);
  }

  void resize(int n, bool) { last_step_ = memory_.resize("last_step", n); }

  void start() {
    rho_ = params_.rho;
    restart();
  }
  void restart() {
    iteration_ = 0;
    omega_ = 1;
  }

  template <class E, class M>
  Heading next(E& e, VectorField<typename P::position, S> const& x, DescentFields<P, S>& fields,
               M const& preconditioner, Step const& last, bool) {
    if (last.backtracks > 0) restart();
    auto const& z = fields.gradient_before;  // the gradient before is not needed
    preconditioner.apply(fields.gradient, z);
    auto const gradient_sums = fields.reducer.template sum<2>(
        "chebyshev_gradient", fields.size(),
        kernels::ChebyshevGradient<P, S>{fields.gradient, z, fields.direction, last_step_,
                                         fields.mass, typename P::real(last.length)});
    Heading heading;
    heading.descent = double(gradient_sums[0]);
    heading.gradient = double(gradient_sums[1]);
    double const form = e.quadratic_form(x, fields.direction);
    double const alpha = form > 0 ? heading.descent / form : 1;

    advance(heading.descent);
    double const momentum = (omega_ - 1) / alpha;
    auto const sums = fields.reducer.template sum<2>(
        "chebyshev_direction", fields.size(),
        kernels::ChebyshevDirection<P, S>{fields.gradient, fields.direction, last_step_,
                                          fields.mass, typename P::real(omega_),
                                          typename P::real(momentum)});
    heading.slope = double(sums[0]);
    heading.metric = double(sums[1]);
    heading.beta = momentum;
    heading.first_length = alpha;
    heading.steepest = omega_ == 1;
    return heading;
  }

private:
  /// omega of this iteration. g'P g tells how fast the error falls.
  void advance(double descent) {
    bool const measures = iteration_ > 0 && iteration_ % params_.delay == 0;
    if (measures && params_.rho == 0) {
      double const rate = std::pow(descent / marked_, 0.5 / (iteration_ - marked_at_));
      double const w = 2 / (1 + std::sqrt(1 - rho_ * rho_));  // where omega tends to
      double const mu = iteration_ == params_.delay ? rate : (rate + (w - 1) / rate) / w;
      if (std::isfinite(mu)) rho_ = std::min(std::max(rho_, mu), largest_rho);
    }
    if (measures || iteration_ == params_.delay / 2) {
      marked_ = descent;
      marked_at_ = iteration_;
    }
    if (iteration_ == params_.delay) omega_ = 2 / (2 - rho_ * rho_);
    if (iteration_ > params_.delay) omega_ = 4 / (4 - rho_ * rho_ * omega_);
    ++iteration_;
  }

  static constexpr double largest_rho = 0.9999;

  ChebyshevParams params_;
  double rho_ = 0, omega_ = 1;
  int iteration_ = 0;
  double marked_ = 0;  ///< g'P g at iteration marked_at_
  int marked_at_ = 0;
  Vectors last_step_;
  Resizable<Vectors> memory_;
};

template <class Preconditioner, class LineSearch, class Stopping>
struct ChebyshevComposition {
  ChebyshevParams chebyshev = {};
  typename Preconditioner::Params preconditioner = {};
  typename LineSearch::Params line_search = {};
  typename Stopping::Params stop = {};
  Budget budget = {};
  Safeguard safeguard = {};
};

template <template <class...> class Preconditioner, class LineSearch = SufficientDecrease,
          class Stopping = DecrementWindow, class Precision = Mixed, class Space = DefaultSpace>
using Chebyshev =
    DescentMinimiser<ChebyshevDirections<Precision, Space>, Preconditioner<Precision, Space>,
                     LineSearch, Stopping,
                     ChebyshevComposition<Preconditioner<Precision, Space>, LineSearch, Stopping>>;

}  // namespace taut
