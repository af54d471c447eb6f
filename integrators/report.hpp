// What a minimiser says when it is done, and what it can tell while it runs.
#pragma once

#include <taut/core/exec/space.hpp>

#include <algorithm>
#include <functional>
#include <limits>
#include <string_view>

namespace taut {

/// Why a minimisation ended.
enum class Stop {
  none,                      ///< it has not
  converged_by_decrement,    ///< DecrementWindow
  converged_by_energy_drop,  ///< EnergyDrop
  converged_by_gradient,     ///< GradientNorm, DecrementWindow where that is proof, or no gradient
  budget_iterations,
  budget_seconds,
  stalled,  ///< no step along -P g lowers the energy: precision is exhausted, or a bound forbids it
  non_finite,  ///< energy or gradient is not a number; x is the last iterate where they were
};

constexpr std::string_view to_string(Stop stop) {
  switch (stop) {
    case Stop::none:
      return "none";
    case Stop::converged_by_decrement:
      return "converged by decrement";
    case Stop::converged_by_energy_drop:
      return "converged by energy drop";
    case Stop::converged_by_gradient:
      return "converged by gradient";
    case Stop::budget_iterations:
      return "stopped by the budget of iterations";
    case Stop::budget_seconds:
      return "stopped by the budget of seconds";
    case Stop::stalled:
      return "stalled";
    case Stop::non_finite:
      return "not finite";
  }
  return "";
}

/// How often the past was forgotten, by cause.
struct Restarts {
  int not_descent = 0;  ///< p was no descent direction
  int curvature = 0;    ///< s'y <= 0, or beta was not finite
  int cut = 0;          ///< a bound had cut the step
  int armijo = 0;       ///< no step along p lowered the energy
  int prescribed = 0;   ///< prescribed unknowns had moved
  int total() const { return not_descent + curvature + cut + armijo + prescribed; }
};

struct MinimiserReport {
  Stop stop = Stop::none;
  int iterations = 0;
  Restarts restarts;
  int skipped_pairs = 0;     ///< steps that L-BFGS could not learn from (s'y too small)
  int backtracks = 0;        ///< steps tried and refused
  int extended = 0;          ///< steps that went on along the direction of the one before
  int cuts = 0;              ///< steps cut by a bound
  int refreshes = 0;         ///< updates of the preconditioner
  int strengthened = 0;      ///< of these, those while it was a stronger one than the first
  double energy_change = 0;  ///< sum over the steps, kg m^2; predicted where nothing measured it
  double error_estimate_m = std::numeric_limits<double>::infinity();    ///< mass-weighted rms, m
  double error_estimate_mps = std::numeric_limits<double>::infinity();  ///< the same over h, m/s
  /// What round-off in the gradient makes of the error whatever the number of iterations, m; the
  /// estimates are never below it. An order of magnitude (Descent::error_floor).
  double error_floor_m = 0;
  double gradient_norm = 0;  ///< |M^-1 g|, mass-weighted rms at the start of the last step, m
  double seconds = 0;
  int bodies = 1;   ///< that minimisers which go by islands can tell apart
  int islands = 1;  ///< the most there were at a time
  int left = 0;     ///< islands that ended while others went on
  int woken = 0;    ///< of these, and of sleeping bodies, those that something came to act on
  int asleep = 0;   ///< bodies that slept through it (sleep.hpp)
  /// Mean share of the unknowns that iterations worked on: less than 1 where islands left early.
  double active = 1;

  bool converged() const {
    return stop == Stop::converged_by_decrement || stop == Stop::converged_by_energy_drop ||
           stop == Stop::converged_by_gradient;
  }
};

/// Of two minimisations, one after the other, as one: it ended as the second did.
inline MinimiserReport in_sequence(MinimiserReport const& first, MinimiserReport const& second) {
  MinimiserReport r = second;
  r.iterations += first.iterations;
  r.restarts.not_descent += first.restarts.not_descent;
  r.restarts.curvature += first.restarts.curvature;
  r.restarts.cut += first.restarts.cut;
  r.restarts.armijo += first.restarts.armijo;
  r.restarts.prescribed += first.restarts.prescribed;
  r.skipped_pairs += first.skipped_pairs;
  r.backtracks += first.backtracks;
  r.extended += first.extended;
  r.cuts += first.cuts;
  r.refreshes += first.refreshes;
  r.strengthened += first.strengthened;
  r.energy_change += first.energy_change;
  r.seconds += first.seconds;
  r.islands = std::max(first.islands, second.islands);
  r.left += first.left;
  r.woken += first.woken;
  if (r.iterations > 0) {
    r.active = (first.active * first.iterations + second.active * second.iterations) / r.iterations;
  }
  return r;
}

/// One step, as an observer sees it.
template <class P, class S>
struct Iteration {
  int index;                                      ///< 0 for the first step
  VectorField<typename P::position, S> const& x;  ///< where it led
  double length;                                  ///< alpha
  double beta, gamma;                             ///< of its direction
  double slope;                                   ///< g'p before it
  double curvature;      ///< p'Hp before it; NaN if the line search did not ask for it
  double energy_change;  ///< by this step
  double energy_change_so_far;
  double gradient_norm;   ///< before it, m
  double error_estimate;  ///< after it, m
};

/// Called after every step; empty: nothing is.
template <class P, class S>
using Observer = std::function<void(Iteration<P, S> const&)>;

}  // namespace taut
