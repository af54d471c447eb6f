// How far to go along a direction. A line search moves x and says what it did; every step is kept
// within Objective::max_step, or a fraction of that.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/potential/objective.hpp>
#include <taut/integrators/preconditioner.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace taut {

/// What a line search did.
struct Step {
  double aimed = 0;          ///< the length tried first, but for bounds
  double length = 0;         ///< alpha; x has moved by alpha p. Negative where p leads uphill
  double energy_change = 0;  ///< kg m^2; predicted by the quadratic model unless `evaluated`
  bool evaluated = false;    ///< the gradient where the step ends is known
  /// The longest |alpha| allowed; infinity if that is known to be more than was asked for.
  double bound = std::numeric_limits<double>::infinity();
  bool cut = false;    ///< the bound made the step shorter
  bool found = true;   ///< false: no step was good enough, x is where it was
  int backtracks = 0;  ///< steps tried and refused
};

/// The line from + alpha p, as line searches see it. `slope` is g'p at its beginning: negative, but
/// where nothing keeps a method from an uphill p (Safeguard off); the way down is alpha < 0 then.
template <class E>
class Line {
public:
  using P = typename E::Precision;
  using S = typename E::Space;
  using Positions = VectorField<typename P::position, S>;
  using Vectors = VectorField<typename P::real, S>;

  /// Gradients at trial points, and where wanted the curvature, are written into
  /// fields.gradient_before and `curvature`; `energy_unit` is the size of energy changes so far,
  /// `negligible` what a stopping rule takes for nothing.
  Line(E& objective, Positions const& x, DescentFields<P, S> const& fields,
       LocalMatrices<P, S> const& curvature, double slope, double energy_unit, double negligible)
      : objective_(objective),
        x_(x),
        fields_(fields),
        curvature_(curvature),
        slope_(slope),
        energy_unit_(energy_unit),
        negligible_(negligible) {}

  double slope() const { return slope_; }
  /// p'Hp at the beginning; asked for once, before the first move. NaN until then.
  double curvature() {
    if (!std::isnan(form_)) return form_;
    if constexpr (CertifyingObjective<E>) {
      form_ = objective_.quadratic_form(x_, fields_.direction, certified_);
    } else {
      form_ = objective_.quadratic_form(x_, fields_.direction);
    }
    return form_;
  }
  double known_curvature() const { return form_; }
  /// Whoever has found p'Hp already may say so.
  void know_curvature(double form) { form_ = form; }
  /// The step of the quadratic model, -g'p / p'Hp; infinity where no curvature is left along p, 0
  /// where nothing is to be gained.
  double newton_length() {
    if (slope_ == 0) return 0;
    if (curvature() > 0) return -slope_ / curvature();
    double const infinity = std::numeric_limits<double>::infinity();
    return slope_ > 0 ? -infinity : infinity;
  }
  /// Whoever knows that x + a p is valid for all a below `length` may say so.
  void know_valid(double length) { valid_ = length; }
  /// max_i |p_i|
  double largest_norm() const {
    return maximum<S>("largest_norm", objective_.size(), 0.0,
                      kernels::LargestNorm<Vectors>{fields_.direction});
  }
  /// `lengths` in metres where there is no inertia, otherwise infinity.
  double reach(double lengths) const {
    Scale const scale = objective_.scale();
    return scale.has_inertia ? std::numeric_limits<double>::infinity() : lengths * scale.length;
  }
  /// Largest step along p, or -p if `backwards`, up to `at_most` that is valid; to be asked for
  /// before the first move.
  double max_length(double at_most, bool backwards) {
    if (!backwards && at_most <= valid_) return at_most;
    if (!backwards) return max_step(at_most);
    kernels::Reverse<P, S> const reverse{fields_.direction};
    for_each<S>("reverse", objective_.size(), reverse);
    double const length = max_step(at_most);
    for_each<S>("reverse", objective_.size(), reverse);
    return length;
  }

  /// x = from + alpha p
  void move(double alpha) {
    for_each<S>("move_along", objective_.size(),
                kernels::MoveAlong<P, S>{x_, fields_.from, fields_.direction,
                                         typename P::position(alpha), !moved_});
    moved_ = true;
    length_ = alpha;
  }
  /// Back to where the line begins, exactly.
  void retreat() {
    if (moved_) assign_on<S>(x_, fields_.from);
  }
  /// Evaluates the gradient at x; the energy difference to the beginning.
  double evaluate() {
    if (curvature_.blocks.extent(0) > 0)
      return objective_.gradient_after(x_, fields_.direction, length_, fields_.gradient_before,
                                       curvature_.blocks);
    if (curvature_.diagonal.extent(0) > 0)
      return objective_.gradient_after(x_, fields_.direction, length_, fields_.gradient_before,
                                       curvature_.diagonal);
    return objective_.gradient_after(x_, fields_.direction, length_, fields_.gradient_before);
  }
  /// g'p of the gradient evaluated last.
  double slope_here() const {
    kernels::Dot<P, S> const dot{fields_.gradient_before, fields_.direction};
    return double(fields_.reducer.template sum<1>("slope", objective_.size(), dot)[0]);
  }
  /// Energy differences below this are round-off, or where a step promises nothing that matters,
  /// as little as that.
  double round_off() {
    double const promised = std::abs(slope_ * length_);
    double const unit = std::max(energy_unit_, promised);
    double const noise = 16 * double(Kokkos::Experimental::epsilon_v<typename P::real>) * unit;
    return promised < negligible_ ? std::max(noise, negligible_) : noise;
  }

private:
  /// Along fields.direction, which is p or -p.
  double max_step(double at_most) {
    if constexpr (CertifyingObjective<E>) {
      return objective_.max_step(x_, fields_.direction, at_most, certified_);
    } else {
      return objective_.max_step(x_, fields_.direction, at_most);
    }
  }

  E& objective_;
  Positions const& x_;
  DescentFields<P, S> const& fields_;
  LocalMatrices<P, S> const curvature_;
  double slope_, energy_unit_, negligible_;
  double form_ = std::numeric_limits<double>::quiet_NaN();
  double valid_ = 0;      ///< how far along p is known to be valid from elsewhere
  double certified_ = 0;  ///< how far along p or -p is known to be valid, where p'Hp has told
  double length_ = 0;
  bool moved_ = false;
};

/// `search(line, first)`: `first` is the length to try first, or 0 for that of the quadratic model.
template <class L, class E>
concept LineSearch = requires(L const& search, Line<E>& line, double first) {
  typename L::Params;
  {L(typename L::Params())};
  { search(line, first) } -> std::same_as<Step>;
};

/// How steps are kept valid and sane.
struct StepBound {
  double fraction = 1;  ///< of Objective::max_step; infinity: do not ask for it
  double max_displacement = std::numeric_limits<double>::infinity();  ///< of any unknown, m
  double reach = 10;  ///< the same in Scale::length where curvature may vanish (no inertia)

  /// The step to try first: `first`, or if that is 0 the one of the quadratic model, within bounds.
  /// Step::bound is looked for up to `stretch` times what is tried.
  template <class E>
  Step first_step(Line<E>& line, double first, double stretch = 1) const {
    Step step{.aimed = first > 0 ? first : line.newton_length()};
    double const aimed = std::abs(step.aimed);
    double const displacement = std::min(max_displacement, line.reach(reach));
    if (std::isfinite(displacement)) step.bound = displacement / line.largest_norm();
    if (std::isfinite(fraction)) {
      double const wanted = std::min(stretch * aimed, step.bound) / fraction;
      double const valid = line.max_length(wanted, step.aimed < 0);
      if (valid < wanted) step.bound = fraction * valid;
    }
    step.cut = aimed > step.bound;
    step.length = std::copysign(std::min(aimed, step.bound), step.aimed);
    step.found = step.length != 0;
    return step;
  }
};

/// The paper's: alpha = -g'p / p'Hp, one pass, no check.
class NewtonStep {
public:
  struct Params {
    StepBound bound;
  };
  NewtonStep() : NewtonStep(Params()) {}
  explicit NewtonStep(Params const& params) : params_(params) {}

  StepBound const& bound() const { return params_.bound; }

  template <class E>
  Step operator()(Line<E>& line, double first) const {
    Step step = params_.bound.first_step(line, first);
    if (!step.found) return step;
    step.energy_change =
        step.length * line.slope() + 0.5 * step.length * step.length * line.curvature();
    line.move(step.length);
    return step;
  }

private:
  Params params_;
};

/// The same, but a step must lower the energy by a fraction of what its slope promises (Armijo);
/// otherwise it is shortened by interpolation. The energy difference comes with the gradient that
/// the next iteration needs anyway, so that the check is free while steps are good.
class SufficientDecrease {
public:
  struct Params {
    StepBound bound;
    double armijo = 1e-4;  ///< fraction of the promised decrease
    int max_backtracks = 6;
  };
  SufficientDecrease() : SufficientDecrease(Params()) {}
  explicit SufficientDecrease(Params const& params) : params_(params) {}

  StepBound const& bound() const { return params_.bound; }

  template <class E>
  Step operator()(Line<E>& line, double first) const {
    Step step = params_.bound.first_step(line, first);
    if (!step.found) return step;
    step.evaluated = true;
    for (;; ++step.backtracks) {
      line.move(step.length);
      step.energy_change = line.evaluate();
      double const promised = step.length * line.slope();
      if (step.energy_change <= params_.armijo * promised + line.round_off()) return step;
      if (step.backtracks == params_.max_backtracks) break;
      // Minimum of the parabola through the slope and both energies.
      double const shrink = -0.5 * promised / (step.energy_change - promised);
      step.length *= std::isfinite(shrink) ? std::clamp(shrink, 0.1, 0.5) : 0.1;
    }
    line.retreat();
    step.found = false;
    return step;
  }

private:
  Params params_;
};

/// The first minimum along the line, to a tight tolerance: for tests and oracles.
class ExactLineSearch {
public:
  struct Params {
    StepBound bound;
    double tolerance = 1e-10;  ///< of |slope| over that at the beginning
    int max_evaluations = 100;
  };
  ExactLineSearch() : ExactLineSearch(Params()) {}
  explicit ExactLineSearch(Params const& params) : params_(params) {}

  StepBound const& bound() const { return params_.bound; }

  /// Doubles the step until the slope has changed its sign, then secant steps (regula falsi with
  /// Illinois weights). A slope that is not a number lies beyond a barrier.
  template <class E>
  Step operator()(Line<E>& line, double first) const {
    Step step = params_.bound.first_step(line, first, std::numeric_limits<double>::infinity());
    if (!step.found) return step;
    step.evaluated = true;
    // Lengths and slopes along the half line that leads down.
    double const sign = step.length < 0 ? -1 : 1;
    double length = std::abs(step.length), bound = step.bound;
    double low = 0, low_slope = sign * line.slope(), high = 0, high_slope = 0;
    int side = 0;
    for (int k = 0; k < params_.max_evaluations; ++k) {
      line.move(sign * length);
      step.energy_change = line.evaluate();
      double const slope = sign * line.slope_here();
      step.cut = length >= bound && slope < 0;
      if (step.cut || std::abs(slope) <= params_.tolerance * std::abs(line.slope())) break;
      if (slope < 0) {
        low = length;
        low_slope = slope;
        if (side < 0) high_slope /= 2;
        side = -1;
      } else {
        high = length;
        high_slope = std::isfinite(slope) ? slope : -low_slope;
        if (side > 0) low_slope /= 2;
        side = 1;
      }
      double const next = high > 0 ? low - low_slope * (high - low) / (high_slope - low_slope)
                                   : std::min(2 * length, bound);
      if (next == low || next == high) break;
      length = next;
    }
    step.length = sign * length;
    step.found = step.energy_change <= line.round_off();
    if (!step.found) line.retreat();
    return step;
  }

private:
  Params params_;
};

}  // namespace taut
