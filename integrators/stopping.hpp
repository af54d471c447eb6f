// When to stop. All rules keep the error estimate that a report shows:
//   |x - x*|_rms <= sqrt(2 (sum of the last energy decrements) / (lambda M)),
// in which M is the mass and lambda the curvature, relative to it, along what is left to go.
//
// With inertia lambda = 1, a lower bound. Without, the smallest value counts of all p'Hp / p'Mp so
// far and of 2 (energy lost) / |x - x0|^2_M, which is the one along all that has been covered:
// loads are smooth, so it ends near the lowest modes, where single directions of a solver that has
// only begun are far too stiff.
//
// The sum stands for what is still to come only if the decrements fall: the window is as long as it
// takes for its second half to gain less than half of what the first one did, and until then
// nothing has converged, unless decrements are so small that even the longest window of them would
// not matter: a free fall starts at its end, and round-off does not fall. With inertia a shorter
// window will do again once it falls by far, and of one that had to grow what is left is taken as a
// geometric series of its halves; without, both would take the end of what smoothing gains for the
// end of all.
//
// Measured with a window of 8 on bars of 1e4 to 1e9 Pa, under implicit Euler and at rest
// (cantilevers of L/t = 10 and 40, a hanging bar, Cook's membrane; CG and L-BFGS, block Jacobi and
// Schwarz): the true error is below 1.7 times the estimate, in steps with inertia below 0.6 times.
// A start that is rough on the scale of elements hides slow modes from it where there is no
// inertia: what smoothing gains falls fast.
#pragma once

#include <taut/core/potential/objective.hpp>
#include <taut/integrators/report.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <tuple>
#include <utility>
#include <vector>

namespace taut {

/// What is known after a step.
struct Progress {
  double decrement = 0;   ///< energy lost in the step (predicted where nothing measured it)
  double attainable = 0;  ///< the same, had nothing cut or shortened the step
  double curvature = 1;   ///< lambda, 0 if unknown; rules ask for it without inertia only
  /// |M^-1 g|, mass-weighted rms before the step, m; infinity: unknown.
  double gradient_norm = std::numeric_limits<double>::infinity();
  double floor = 0;  ///< what round-off makes of the error, m (MinimiserReport)
  /// The step is no measure of what is left: it cannot end a minimisation.
  bool shortened = false;
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
  /// Where steps promise less energy than this, kg m^2, it does not matter what they gain or lose
  /// of it.
  { c.negligible() } -> std::convertible_to<double>;
};

/// A rule that judges by the gradient besides, before a direction is made of it.
template <class R, class E>
concept GradientRule = Stopping<R> &&
    requires(R& rule, E& e, VectorField<typename E::Precision::real, typename E::Space> const& g) {
  { rule.judge(e, g) } -> std::same_as<Stop>;
};

// A rule that is relative to the first step may also have `join(part)` and `resume(scale)`: where
// two islands become one within a minimisation, it stays relative to the first step of the part
// that had more to do, and begins the rest anew, for the mass of both.
template <class R>
void join_rule(R& rule, R const& part) {
  if constexpr (requires { rule.join(part); }) rule.join(part);
}
template <class R>
void resume_rule(R& rule, Scale const& scale) {
  if constexpr (requires { rule.resume(scale); }) {
    rule.resume(scale);
  } else {
    rule.start(scale);
  }
}

/// The sum over the last steps, and the error that it predicts.
class ErrorEstimate {
public:
  /// At least so many steps are summed, and at most `longest`.
  explicit ErrorEstimate(int window = 8)
      : least_(std::size_t(std::max(window, 1))), most_(std::max(least_, longest)) {
    decrements_.reserve(most_);
  }

  void start(Scale const& scale) {
    scale_ = scale;
    curvature_ = 1;
    floor_ = 0;
    forget();
  }
  void forget() {
    count_ = 0;
    window_ = least_;
    conclusive_ = false;
  }
  void add(Progress const& progress) {
    if (!scale_.has_inertia) curvature_ = progress.curvature;
    floor_ = progress.floor;
    double const attainable = std::abs(progress.attainable);
    if (progress.stuck) {
      window_ = least_;
      decrements_.assign(window_, attainable);
      count_ = window_;
      conclusive_ = true;
    } else {
      put(attainable);
      adapt();
      conclusive_ = conclusive_ && !progress.shortened;
    }
  }
  /// The window is full and falls, and the last step was one to judge by.
  bool conclusive() const { return conclusive_; }
  /// Steps that are summed now.
  int window() const { return static_cast<int>(window_); }

  /// In metres; infinity before the first step. A window that is not full is extrapolated.
  double error_estimate() const { return std::max(unfloored_estimate(), floor_); }
  double negligible() const { return 0; }

protected:
  static constexpr std::size_t longest = 1024;

  double unfloored_estimate() const {
    if (count_ == 0) return std::numeric_limits<double>::infinity();
    double const left = energy_left();
    return left == 0 ? 0 : std::sqrt(2 * left / (curvature_ * scale_.mass));
  }

  Scale scale_;
  double floor_ = 0;

  /// Whether each of the least number of steps to be summed was attained less than `energy`.
  bool all_below(double energy) const { return count_ >= least_ && sum(0, least_) < energy; }

private:
  /// A window whose second half gains less than 1/16 of what the first did is longer than needed.
  static constexpr double much_less = 1. / 16;
  /// Steps that are enough to tell by, whatever was before them.
  static constexpr std::size_t tells = 32;

  /// The sum over the window; over one that had to grow and falls now, what a geometric series of
  /// its halves has left, but no less than the least number of steps have gained.
  double energy_left() const {
    std::size_t const known = std::min(count_, window_), quarter = window_ / 4;
    double const all = sum(0, known) * double(window_) / double(known);
    bool const long_enough = conclusive_ && window_ >= std::max(2 * least_, tells);
    if (!long_enough || !scale_.has_inertia) return all;  // without inertia slow modes hide
    double const last = sum(0, quarter), late = last + sum(quarter, 2 * quarter);
    double const before = late - last, early = all - late;
    // From half to half; by the last half alone, where the one before had more to lose.
    double const fall = std::max(late / early, (last / before) * (last / before));
    if (!(fall <= 0.5)) return all;
    return std::max(sum(0, least_), late * fall / (1 - fall));
  }
  void put(double decrement) {
    std::size_t const at = count_++ % most_;
    if (at < decrements_.size()) {
      decrements_[at] = decrement;
    } else {
      decrements_.push_back(decrement);
    }
  }
  /// Steps from the last but `begin` back to the last but `end`.
  double sum(std::size_t begin, std::size_t end) const {
    double total = 0;
    for (std::size_t k = begin; k < end; ++k) {
      total += decrements_[(count_ - 1 - k) % most_];
    }
    return total;
  }
  void adapt() {
    // Where inertia bounds how slow a mode can be, the last steps tell, whatever was before them.
    for (std::size_t w = std::max(4 * least_, tells);
         scale_.has_inertia && w < window_ && w <= count_; w *= 2) {
      if (!falls(w, much_less)) continue;
      window_ = w;
      break;
    }
    conclusive_ = count_ >= window_;
    if (!conclusive_ || window_ == 1) return;
    conclusive_ = falls(window_, 0.5);
    if (!conclusive_) {
      window_ = std::min(2 * window_, most_);
    } else if (falls(window_, much_less)) {
      window_ = std::max(window_ / 2, least_);
    }
  }
  /// Whether the second half of the last `window` steps gained no more than `share` of the first.
  bool falls(std::size_t window, double share) const {
    return sum(0, window / 2) <= share * sum(window / 2, window);
  }

  std::size_t least_, most_, window_ = least_;
  /// A ring of `most_`, made as steps come: a copy of a rule that has not begun is small.
  std::vector<double> decrements_;
  std::size_t count_ = 0;
  bool conclusive_ = false;
  double curvature_ = 1;
};

/// Stops when the estimated error is below `tolerance` lengths, or the gradient says that nothing
/// is left to do. Where round-off forbids that, it stops as stalled once further steps gain less
/// than round-off costs.
class DecrementWindow : public ErrorEstimate {
public:
  struct Params {
    double tolerance = 1e-3;  ///< of Scale::length; 0 switches the rule off
    int window = 8;           ///< steps at least
  };
  DecrementWindow() : DecrementWindow(Params()) {}
  explicit DecrementWindow(Params const& params) : ErrorEstimate(params.window), params_(params) {}

  void start(Scale const& scale) {
    ErrorEstimate::start(scale);
    proved_ = std::numeric_limits<double>::infinity();
  }
  void forget() {
    ErrorEstimate::forget();
    proved_ = std::numeric_limits<double>::infinity();
  }
  Stop check(Progress const& progress) {
    add(progress);
    double const tolerance = params_.tolerance * scale_.length;
    if (scale_.has_inertia && progress.gradient_norm < certain * tolerance && floor_ < tolerance) {
      proved_ = progress.gradient_norm;
      return Stop::converged_by_gradient;
    }
    bool const known = conclusive() || (all_below(negligible()) && !progress.shortened);
    if (!known || params_.tolerance == 0) return Stop::none;
    if (error_estimate() < tolerance) return Stop::converged_by_decrement;
    return unfloored_estimate() < 0.25 * floor_ ? Stop::stalled : Stop::none;
  }
  double error_estimate() const {
    return std::max(std::min(unfloored_estimate(), proved_), floor_);
  }
  /// The longest window of such steps amounts to the tolerance. Zero without inertia, where the
  /// curvature that is left along is known too late.
  double negligible() const {
    double const error = params_.tolerance * scale_.length;
    return scale_.has_inertia ? 0.5 * scale_.mass * error * error / double(longest) : 0;
  }

private:
  /// With inertia H >= M where the energy is convex, so |M^-1 g| bounds the error before the last
  /// step: a body that nothing deforms or touches needs no window. Where it is not convex, there is
  /// this factor to spare.
  static constexpr double certain = 0.1;

  Params params_;
  double proved_ = std::numeric_limits<double>::infinity();  ///< a bound of the error, m
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
    first_ = 0;
  }
  void join(EnergyDrop const& part) {
    first_ = std::max(first_, part.first_);
    steps_ = std::max(steps_, part.steps_);
  }
  void resume(Scale const& scale) { ErrorEstimate::start(scale); }
  Stop check(Progress const& progress) {
    add(progress);
    if (steps_++ == 0) first_ = progress.decrement;
    // What round-off makes of a minimum is no energy to lose: a free fall begins at its end.
    double const noise = 0.5 * scale_.mass * floor_ * floor_;
    bool const reached = params_.tolerance > 0 && steps_ > params_.min_iterations &&
                         progress.decrement <= std::max(params_.tolerance * first_, noise);
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
  void join(GradientNorm const& part) { unit_ = std::max(unit_, part.unit_); }
  void resume(Scale const& scale) { ErrorEstimate::start(scale); }
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
  void join(AnyOf const& part) {
    [&]<std::size_t... k>(std::index_sequence<k...>) {
      (join_rule(std::get<k>(rules_), std::get<k>(part.rules_)), ...);
    }
    (std::index_sequence_for<Rules...>());
  }
  void resume(Scale const& scale) {
    std::apply([&](Rules&... rule) { (resume_rule(rule, scale), ...); }, rules_);
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
  /// Of the rules that judge by the gradient.
  template <class E>
  Stop judge(E& e, VectorField<typename E::Precision::real, typename E::Space> const& g) requires(
      GradientRule<Rules, E> || ...) {
    Stop stop = Stop::none;
    auto const ask = [&](auto& rule) {
      if constexpr (requires { rule.judge(e, g); }) {
        if (stop == Stop::none) stop = rule.judge(e, g);
      }
    };
    std::apply([&](Rules&... rule) { (ask(rule), ...); }, rules_);
    return stop;
  }
  double error_estimate() const { return std::get<0>(rules_).error_estimate(); }
  double negligible() const { return std::get<0>(rules_).negligible(); }

private:
  std::tuple<Rules...> rules_;
};

/// What a minimisation may cost at most.
struct Budget {
  int max_iterations = 1000;
  double max_seconds = std::numeric_limits<double>::infinity();
};

}  // namespace taut
