// The alternating direction method of multipliers (Boyd et al. 2011; for simulation Narain et al.
// 2016, for material points Fang et al. 2019). What is stiff in the potential is replaced by a
// quadratic in x around local copies of what it depends on,
//
//   min_x  E_rest(x) + k/2 |D x - z + u|^2,      z, u by local minimisations at the last x,
//
// whose Hessian does not change: one linear operator, with one preconditioner, per minimisation.
// The copies are a policy. Steps are those of the method, not of a line search: the energy may
// rise, and near the minimum the rate is that of the method, whatever the linear solver. A step is
// solved for as a correction of x, so that an inexact solve does not move the fixed point. What
// round-off makes of the error is not estimated.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/integrators/linear_solver.hpp>
#include <taut/integrators/newton.hpp>
#include <taut/integrators/stopping.hpp>

#include <cmath>
#include <utility>

namespace taut {

/// How the potential E is split.
template <class X, class E>
concept LocalCopies = requires(
    X& copies, E& e, VectorField<typename E::Precision::position, typename E::Space> const& x,
    VectorField<typename E::Precision::real, typename E::Space> const& v) {
  typename X::Params;
  {X(typename X::Params())};
  /// Copies of x, with multipliers that balance the forces there; the operator and its
  /// preconditioner.
  {copies.start(e, x)};
  /// Local minimisations at x, except for the first time; v, the gradient of E at x, becomes that
  /// of the split function.
  {copies.update(e, x, v)};
  /// hd = H d with the Hessian of the split function; z = P r with something close to its inverse.
  {copies.product(v, v)};
  {copies.apply(v, v)};
};

namespace kernels {

/// b = -g
template <class P, class S>
struct SplitRightHandSide {
  VectorField<typename P::real, S> g, b;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) b(i, c) = -g(i, c);
  }
};

}  // namespace kernels

template <class Copies_, class Stopping_ = DecrementWindow, class Precision_ = Mixed,
          class Space_ = DefaultSpace>
class Admm {
public:
  using Precision = Precision_;
  using Space = Space_;
  using Positions = VectorField<typename Precision::position, Space>;
  using Vectors = VectorField<typename Precision::real, Space>;

  struct Params {
    typename Copies_::Params copies = {};
    typename Stopping_::Params stop = {};
    Budget budget = {};
    /// Of the linear solves: relative residual, and products at most. A loose one costs no accuracy
    /// in the end.
    double linear_tolerance = 0.1;
    int max_linear_iterations = 1000;
  };

  Admm() : Admm(Params()) {}
  explicit Admm(Params const& params)
      : params_(params), copies_(params.copies), stopping_(params.stop) {}

  /// Minimises e from x, in place. Throws what the copies throw.
  template <Objective E>
  NewtonReport minimise(E& e, Positions const& x, Observer<Precision, Space> const& observer = {}) {
    static_assert(LocalCopies<Copies_, E>,
                  "taut: Admm's first argument must satisfy LocalCopies (integrators/admm.hpp)");
    Kokkos::Timer const timer;
    resize(e.size());
    Scale const scale = e.scale();
    NewtonReport report;
    stopping_.start(scale);
    bool prescribed_left = true, started = false;
    while (report.stop == Stop::none) {
      if (report.iterations >= params_.budget.max_iterations) {
        report.stop = Stop::budget_iterations;
        break;
      }
      if (timer.seconds() >= params_.budget.max_seconds) {
        report.stop = Stop::budget_seconds;
        break;
      }
      measure(e, x, report);
      if (report.stop == Stop::none) step(e, x, std::exchange(started, true), report, observer);
      if (report.stop == Stop::non_finite) break;
      if (prescribed_left) prescribed_left = e.advance_prescribed(x);
      if (!prescribed_left) continue;
      if (report.stop != Stop::none) ++report.iterations;  // motion alone uses up budget too
      ++report.restarts.prescribed;
      stopping_.forget();
      started = false;
      report.stop = Stop::none;
    }
    report.error_estimate_m = stopping_.error_estimate();
    report.error_estimate_mps = report.error_estimate_m / scale.time_step;
    report.seconds = timer.seconds();
    return report;
  }

  Params const& params() const { return params_; }

private:
  /// The gradient at x, and whether that says enough.
  template <class E>
  void measure(E& e, Positions const& x, NewtonReport& report) {
    e.gradient(x, gradient_);
    // Its right-hand side is none here: step() writes right_ anew, from the split function.
    using Norms = kernels::NewtonRightHandSide<Precision, Space>;
    double const square = reducer_.template sum<Norms::count>(
        "admm_gradient", e.size(), Norms{gradient_, right_, e.mass()})[Norms::weighted];
    report.gradient_norm = std::sqrt(square / e.scale().mass);
    if (!std::isfinite(square)) {
      report.stop = Stop::non_finite;
    } else if (square == 0) {
      stopping_.check({.stuck = true});
      report.stop = Stop::converged_by_gradient;
    } else if constexpr (GradientRule<Stopping_, E>) {
      report.stop = stopping_.judge(e, gradient_);
    }
  }
  template <class E>
  void step(E& e, Positions const& x, bool started, NewtonReport& report,
            Observer<Precision, Space> const& observer) {
    if (!started) {
      copies_.start(e, x);
      ++report.refreshes;
    }
    copies_.update(e, x, gradient_);
    for_each<Space>("admm_rhs", e.size(),
                    kernels::SplitRightHandSide<Precision, Space>{gradient_, right_});
    auto const product = [&](Vectors const& d, Vectors const& hd) { copies_.product(d, hd); };
    LinearReport const linear =
        linear_.solve(product, copies_, right_, LinearTolerance(params_.linear_tolerance),
                      params_.max_linear_iterations, direction_);
    report.linear_iterations += linear.iterations;
    // A material that bears no inversion keeps its margin: the method itself has none.
    double const length = e.max_step(x, direction_, 1.0);
    report.cuts += length < 1;
    double const change = e.difference(x, direction_, length);
    if (!std::isfinite(change)) {
      report.stop = Stop::non_finite;
      return;
    }
    using Move = kernels::MoveAlong<Precision, Space>;
    for_each<Space>("admm_step", e.size(),
                    Move{x, from_, direction_, typename Precision::position(length), true});
    report.energy_change += change;
    report.stop = stopping_.check({.decrement = -change,
                                   .attainable = -change,
                                   .gradient_norm = report.gradient_norm,
                                   .shortened = length < 1});
    if (observer) {
      observer({report.iterations, x, length, 0, 0, 0, std::numeric_limits<double>::quiet_NaN(),
                change, report.energy_change, report.gradient_norm, stopping_.error_estimate()});
    }
    ++report.iterations;
  }
  void resize(int n) {
    if (static_cast<int>(right_.extent(0)) == n) return;
    gradient_ = memory_[0].resize("admm_gradient", n);
    right_ = memory_[1].resize("admm_right", n);
    direction_ = memory_[2].resize("admm_direction", n);
    from_ = from_memory_.resize("admm_from", n);
    linear_.resize(n);
    reducer_.provide(n, kernels::NewtonRightHandSide<Precision, Space>::count);
  }

  Params params_;
  Copies_ copies_;
  Stopping_ stopping_;
  ConjugateGradients<Precision, Space> linear_;
  Vectors gradient_, right_, direction_;
  Positions from_;
  Resizable<Vectors> memory_[3];
  Resizable<Positions> from_memory_;
  Reducer<Space> reducer_;
};

}  // namespace taut
