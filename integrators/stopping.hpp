// When to stop. All rules keep the error estimate that a report shows:
//   |x - x*|_rms <= sqrt(2 (sum of the last energy decrements) / (lambda M)),
// in which M is the mass and lambda a lower bound of the curvature relative to it: 1 with inertia;
// without, the smallest p'Hp / p'Mp that was seen. It sees rigid motion and means the same for
// every stiffness (measured: within a factor of 0.7 to 1.6 of the true error for windows of 8
// steps).
#pragma once

#include <taut/core/potential/objective.hpp>
#include <taut/integrators/report.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <tuple>
#include <vector>

namespace taut {

/// What is known after a step.
struct Progress {
  double decrement = 0;      ///< energy lost in the step (predicted where nothing measured it)
  double attainable = 0;     ///< the same, had no bound cut the step
  double curvature = 0;      ///< p'Hp / p'Mp; only needed without inertia
  double gradient_norm = 0;  ///< |M^-1 g|, mass-weighted rms before the step, m
  /// No further step is possible; `attainable` stands for all that were to come.
  bool stuck = false;
};

/// A rule: `start` of a minimisation, `check` after each step, `forget` when the energies before do
/// not compare with those to come (prescribed unknowns have moved).
template <class R>
concept Stopping = requires(R& rule, R const& c, Scale const& scale, Progress const& progress) {
  typename R::Params;
  {R(typename R::Params())};
  {rule.start(scale)};
  { rule.check(progress) } -> std::same_as<Stop>;
  {rule.forget()};
  { c.error_estimate() } -> std::convertible_to<double>;
};

/// The sum over the last steps, and the error that it predicts.
class ErrorEstimate {
public:
  explicit ErrorEstimate(int window = 8) : decrements_(std::size_t(std::max(window, 1))) {}

  void start(Scale const& scale) {
    scale_ = scale;
    curvature_ = scale.has_inertia ? 1 : std::numeric_limits<double>::infinity();
    forget();
  }
  void forget() { count_ = 0; }
  void add(Progress const& progress) {
    if (!scale_.has_inertia && progress.curvature > 0)
      curvature_ = std::min(curvature_, progress.curvature);
    double const attainable = std::abs(progress.attainable);
    if (progress.stuck) {
      std::fill(decrements_.begin(), decrements_.end(), attainable);
      count_ = decrements_.size();
    } else {
      decrements_[count_++ % decrements_.size()] = attainable;
    }
  }
  bool full() const { return count_ >= decrements_.size(); }

  /// In metres; infinity before the first step. A window that is not full is extrapolated.
  double error_estimate() const {
    if (count_ == 0) return std::numeric_limits<double>::infinity();
    std::size_t const known = std::min(count_, decrements_.size());
    double sum = 0;
    for (std::size_t k = 0; k < known; ++k) sum += decrements_[k];
    sum *= double(decrements_.size()) / double(known);
    return std::sqrt(2 * sum / (curvature_ * scale_.mass));
  }

protected:
  Scale scale_;

private:
  std::vector<double> decrements_;
  std::size_t count_ = 0;
  double curvature_ = 1;
};

/// Stops when the estimated error is below `tolerance` lengths.
class DecrementWindow : public ErrorEstimate {
public:
  struct Params {
    double tolerance = 1e-3;  ///< of Scale::length; 0 switches the rule off
    int window = 8;           ///< steps; 32 where the stiffness is extreme for the preconditioner
  };
  DecrementWindow() : DecrementWindow(Params()) {}
  explicit DecrementWindow(Params const& params) : ErrorEstimate(params.window), params_(params) {}

  Stop check(Progress const& progress) {
    add(progress);
    bool const reached = full() && error_estimate() < params_.tolerance * scale_.length;
    return reached ? Stop::converged_by_decrement : Stop::none;
  }

private:
  Params params_;
};

/// The paper's rule: a step gains less than `tolerance` times what the first one gained.
class EnergyDrop : public ErrorEstimate {
public:
  struct Params {
    double tolerance = 1e-4;  ///< relative; 0 switches the rule off
    int min_iterations = 0;   ///< no stop before so many steps
  };
  EnergyDrop() : EnergyDrop(Params()) {}
  explicit EnergyDrop(Params const& params) : params_(params) {}

  void start(Scale const& scale) {
    ErrorEstimate::start(scale);
    steps_ = 0;
  }
  Stop check(Progress const& progress) {
    add(progress);
    if (steps_++ == 0) first_ = progress.decrement;
    bool const reached =
        steps_ > params_.min_iterations && progress.decrement < params_.tolerance * first_;
    return reached ? Stop::converged_by_energy_drop : Stop::none;
  }

private:
  Params params_;
  int steps_ = 0;
  double first_ = 0;
};

/// Stops when |M^-1 g|, the mass-weighted rms of M^-1 g in metres, was below a tolerance before the
/// last step. With inertia (H >= M) it bounds the error of a convex problem, generously so when
/// stiff.
class GradientNorm : public ErrorEstimate {
public:
  struct Params {
    double tolerance = 1e-3;  ///< of Scale::length, or of the first norm; 0 switches the rule off
    bool relative = false;    ///< to the first norm
  };
  GradientNorm() : GradientNorm(Params()) {}
  explicit GradientNorm(Params const& params) : params_(params) {}

  void start(Scale const& scale) {
    ErrorEstimate::start(scale);
    unit_ = params_.relative ? 0 : scale.length;
  }
  Stop check(Progress const& progress) {
    add(progress);
    if (unit_ == 0) unit_ = progress.gradient_norm;
    bool const reached = progress.gradient_norm < params_.tolerance * unit_;
    return reached ? Stop::converged_by_gradient : Stop::none;
  }

private:
  Params params_;
  double unit_ = 0;
};

/// Stops when any of its rules does; the first one's error estimate is reported.
template <Stopping... Rules>
class AnyOf {
public:
  struct Params {
    std::tuple<typename Rules::Params...> rules;
  };
  AnyOf() : AnyOf(Params()) {}
  explicit AnyOf(Params const& params) : rules_(params.rules) {}

  void start(Scale const& scale) {
    std::apply([&](Rules&... rule) { (rule.start(scale), ...); }, rules_);
  }
  void forget() {
    std::apply([](Rules&... rule) { (rule.forget(), ...); }, rules_);
  }
  Stop check(Progress const& progress) {
    Stop stop = Stop::none;
    auto const ask = [&](auto& rule) {
      Stop const answer = rule.check(progress);  // asked even if another has answered: rules count
      if (stop == Stop::none) stop = answer;
    };
    std::apply([&](Rules&... rule) { (ask(rule), ...); }, rules_);
    return stop;
  }
  double error_estimate() const { return std::get<0>(rules_).error_estimate(); }

private:
  std::tuple<Rules...> rules_;
};

/// What a minimisation may cost at most.
struct Budget {
  int max_iterations = 1000;
  double max_seconds = std::numeric_limits<double>::infinity();
};

}  // namespace taut
