// The loop that nonlinear CG, L-BFGS and Chebyshev's method share:
//   p from the gradient, by a Direction;  alpha by a LineSearch;  x <- x + alpha p;  until a rule
//   stops.
//
// It forgets the past (restarts from p = -P g) when p is no descent direction, when a bound has cut
// the step (otherwise momentum keeps pushing what the bound has parked), when no step along p
// lowers the energy, and when prescribed unknowns have moved.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/integrators/line_search.hpp>
#include <taut/integrators/preconditioner.hpp>
#include <taut/integrators/report.hpp>
#include <taut/integrators/stopping.hpp>

#include <cmath>
#include <utility>

namespace taut {

/// What a Direction says about the p that it has made.
struct Heading {
  double slope = 0;  ///< g'p
  /// What g'p is judged by: g'P g, or |g'p| where p = -B g with a B that is positive definite by
  /// construction (L-BFGS, Newton) and anything below zero will do.
  double descent = 0;
  double metric = 0;    ///< p'M p
  double form = 0;      ///< p'H p where the method has found it; 0: not known
  double gradient = 0;  ///< g' M^-1 g
  double beta = 0, gamma = 0;
  double first_length = 0;  ///< step to try first; 0: that of the quadratic model
  bool steepest = false;    ///< p = -P g: there is nothing to forget
  bool lost = false;        ///< the past had to be forgotten (s'y <= 0)
  bool skipped = false;     ///< the last step taught nothing (s'y too small); the past is kept
  bool solved = false;      ///< p = -H^-1 g, as far as it was asked for
  bool goes_on = false;     ///< the last p once more: only its slope is new
  bool shortened = false;   ///< p is not all that the method would go for: no measure of the error
};

/// The sequence of directions of a method. `next` makes fields.direction from fields.gradient at x
/// and the step that led there; `renewed` says that the preconditioner is not the one of the last
/// call.
template <class D, class E, class M>
concept Direction = requires(
    D& direction, E& e, VectorField<typename E::Precision::position, typename E::Space> const& x,
    DescentFields<typename E::Precision, typename E::Space>& fields, M const& preconditioner,
    Step const& last, bool renewed) {
  {direction.restart()};
  { direction.next(e, x, fields, preconditioner, last, renewed) } -> std::same_as<Heading>;
};

/// When the preconditioner is due (see Refresh).
class RefreshClock {
public:
  explicit RefreshClock(Refresh const& refresh) : refresh_(refresh) { make_due(); }
  bool due() const { return age_ >= refresh_.interval; }
  bool due_after_step() const { return age_ >= refresh_.interval - 1; }
  void make_due() { age_ = refresh_.interval; }
  void updated() { age_ = 0, longest_ = 0; }
  void stepped(double length) {
    ++age_;
    longest_ = std::max(longest_, length);
    if (length * refresh_.trigger < longest_) make_due();
  }

private:
  Refresh refresh_;
  int age_ = 0;
  double longest_ = 0;
};

/// Restarts where promised. Off, every direction and every cut is taken as it comes (the paper).
struct Safeguard {
  bool on = true;
  double least_descent = 1e-3;  ///< p descends if g'p <= -least_descent times Heading::descent
  /// Nonlinear CG goes on along p where a step leaves more than this of its slope,
  double still_steep = 0.7;
  double stretch = 10;  ///< by up to so many times the step.
};

/// Stalled if what remains is round-off, which the line search lets pass: over a window as long as
/// everything before it (but not forever longer), steps did not lower the energy, or by less on
/// average than its round-off and no faster than in the window before.
class StallWatch {
public:
  void stepped(double energy_change) { recent_change_ += energy_change; }
  Stop check(int iterations, double noise) {
    if (iterations < window_end_) return Stop::none;
    double const mean = -recent_change_ / (window_end_ - window_begin_);
    bool const lost_in_noise = mean < noise && mean > 0.7 * last_mean_;
    bool const stalled = mean <= 0 || lost_in_noise;
    recent_change_ = 0;
    last_mean_ = mean;
    window_begin_ = std::exchange(window_end_, window_end_ + std::min(window_end_, longest_window));
    return stalled ? Stop::stalled : Stop::none;
  }

private:
  static constexpr int longest_window = 512;
  int window_begin_ = 0, window_end_ = 32;                      ///< iterations
  double recent_change_ = 0;                                    ///< of energy in this window
  double last_mean_ = std::numeric_limits<double>::infinity();  ///< decrement of a step in the last
};

/// What round-off makes of the error, m: `positions`, that of the positions, and `edges`, that of
/// the edges in which a gradient is computed; and where H is inverted by iterating with an
/// approximation of it, that of the gradient, K times the latter, in the lowest modes, which take
/// one share of the 3n in which it is spread. `stiffest` and `lowest`: curvature relative to the
/// mass; the former 0 where H is inverted. The factor is measured (CG and L-BFGS in mixed precision
/// on the bars and beams of stopping.hpp end at 0.14 to 2.4 times this).
inline double round_off_floor(double positions, double edges, double stiffest, double lowest,
                              int unknowns) {
  constexpr double measured = 8;
  double floor = positions + edges;
  if (stiffest > 0) floor += measured * edges * stiffest / (lowest * std::sqrt(3.0 * unknowns));
  return floor;
}

/// One minimisation: holds what the loop needs to know between its parts.
template <class E, class M, class D, class Search, class Rule>
requires Objective<E> && Preconditioner<M, E> && Direction<D, E, M> && LineSearch<Search, E> &&
    Stopping<Rule>
class Descent {
public:
  using P = typename E::Precision;
  using S = typename E::Space;
  using Positions = VectorField<typename P::position, S>;

  Descent(E& e, Positions const& x, DescentFields<P, S>& fields, M& preconditioner, D& direction,
          Search const& search, Rule& rule, Budget const& budget, Safeguard const& safeguard,
          Observer<P, S> const& observer)
      : e_(e),
        x_(x),
        fields_(fields),
        preconditioner_(preconditioner),
        direction_(direction),
        search_(search),
        rule_(rule),
        budget_(budget),
        safeguard_(safeguard),
        observer_(observer),
        scale_(e.scale()),
        clock_(preconditioner.refresh()) {}

  MinimiserReport run() {
    Kokkos::Timer const timer;
    fields_.mass = e_.mass();
    rule_.start(scale_);
    direction_.start();
    if constexpr (requires { preconditioner_.start(); }) preconditioner_.start();
    start_travel();
    position_noise_ = epsilon<typename P::position> * largest_position();
    while (report_.stop == Stop::none) {
      if (report_.iterations >= budget_.max_iterations) {
        report_.stop = Stop::budget_iterations;
      } else if (timer.seconds() >= budget_.max_seconds) {
        report_.stop = Stop::budget_seconds;
      } else {
        iterate();
      }
    }
    report_.error_floor_m = error_floor();
    report_.error_estimate_m = std::max(rule_.error_estimate(), report_.error_floor_m);
    report_.error_estimate_mps = report_.error_estimate_m / scale_.time_step;
    report_.seconds = timer.seconds();
    return report_;
  }

private:
  template <class T>
  static constexpr double epsilon = double(Kokkos::Experimental::epsilon_v<T>);

  void iterate() {
    measure();
    if (ends_here()) return;
    bool const renewed = renew();
    Heading const heading = aim(renewed);
    report_.gradient_norm = std::sqrt(heading.gradient / scale_.mass);
    if (!std::isfinite(heading.slope)) {
      if (report_.iterations > 0) assign_on<S>(x_, fields_.from);
      report_.stop = Stop::non_finite;
    } else if (heading.descent == 0) {
      if (advance_prescribed())
        return void(++report_.iterations);  // motion alone uses up budget too
      rule_.check({.stuck = true});
      report_.stop = Stop::converged_by_gradient;
    } else {
      step(heading);
    }
  }

  /// The gradient at x, as far as it is not known, and the curvature that is due.
  void measure() {
    LocalMatrices<P, S> const& curvature = preconditioner_.curvature();
    if (!step_.evaluated || (clock_.due() && !fresh_curvature_ && !curvature.empty())) {
      if (clock_.due() && curvature.blocks.extent(0) > 0) {
        e_.gradient(x_, fields_.gradient, curvature.blocks);
      } else if (clock_.due() && curvature.diagonal.extent(0) > 0) {
        e_.gradient(x_, fields_.gradient, curvature.diagonal);
      } else {
        e_.gradient(x_, fields_.gradient);
      }
    }
  }
  /// Whether a rule that judges by the gradient has seen enough.
  bool ends_here() {
    if constexpr (GradientRule<Rule, E>) {
      Stop const stop = rule_.judge(e_, fields_.gradient);
      if (stop == Stop::none) return false;
      if (advance_prescribed()) {
        ++report_.iterations;
      } else {
        report_.stop = stop;
      }
      return true;
    } else {
      return false;
    }
  }
  /// True if the preconditioner was due, and is that of x now.
  bool renew() {
    if (!clock_.due()) return false;
    preconditioner_.update(e_, x_);
    clock_.updated();
    ++report_.refreshes;
    if constexpr (requires { preconditioner_.strong(); }) {
      report_.strengthened += preconditioner_.strong();
    }
    return true;
  }

  Heading aim(bool renewed) {
    Heading const heading = direction_.next(e_, x_, fields_, preconditioner_, step_, renewed);
    report_.restarts.curvature += heading.lost;
    report_.skipped_pairs += heading.skipped;
    report_.extended += heading.goes_on;
    bool const descends = heading.slope <= -safeguard_.least_descent * heading.descent;
    if (!safeguard_.on || heading.steepest || descends) return heading;
    ++report_.restarts.not_descent;
    direction_.restart();
    return direction_.next(e_, x_, fields_, preconditioner_, step_, false);
  }

  void step(Heading const& heading) {
    // The gradient where the step ends is written over the one before the last step.
    bool const curvature_due = clock_.due_after_step();
    Line<E> line(e_, x_, fields_,
                 curvature_due ? preconditioner_.curvature() : LocalMatrices<P, S>(), heading.slope,
                 largest_decrement_, rule_.negligible());
    if (heading.form > 0) line.know_curvature(heading.form);
    if (!scale_.has_inertia) line.curvature();
    step_ = search_(line, heading.first_length);
    report_.backtracks += step_.backtracks;
    report_.cuts += step_.cut;
    if (!step_.found) return give_up(heading, line);

    std::swap(fields_.gradient, fields_.gradient_before);
    fresh_curvature_ = step_.evaluated && curvature_due;
    clock_.stepped(step_.length);

    // What a step that was cut or shortened has gained says nothing about what is left.
    double const decrement = -step_.energy_change;
    double const attainable = 0.5 * std::abs(heading.slope * step_.aimed);
    bool const backtracked = step_.backtracks > 0;
    largest_decrement_ = std::max(largest_decrement_, decrement);
    report_.energy_change += step_.energy_change;
    watch_.stepped(step_.energy_change);
    lost_energy_ += decrement;
    learn_curvature(line.known_curvature() / heading.metric, heading.solved);
    lowest_curvature_ = find_lowest_curvature();
    Stop const stop = rule_.check(
        {.decrement = decrement,
         .attainable = step_.cut || backtracked ? std::max(decrement, attainable) : decrement,
         .curvature = lowest_curvature_,
         .gradient_norm = report_.gradient_norm,
         .floor = error_floor(),
         .shortened = backtracked || heading.shortened});
    if (observer_) {
      observer_({report_.iterations, x_, step_.length, heading.beta, heading.gamma, heading.slope,
                 line.known_curvature(), step_.energy_change, report_.energy_change,
                 report_.gradient_norm, rule_.error_estimate()});
    }
    ++report_.iterations;
    if (safeguard_.on && step_.cut) {
      ++report_.restarts.cut;
      direction_.restart();
    }
    if (advance_prescribed()) return;
    double const noise = 16 * epsilon<typename P::real> * largest_decrement_;
    report_.stop = stop != Stop::none ? stop : watch_.check(report_.iterations, noise);
  }

  /// No step along p was good enough. Along -P g that is the end, unless prescribed unknowns are
  /// still to move: converged if even what the step promised is too little to count.
  void give_up(Heading const& heading, Line<E>& line) {
    step_.evaluated = false;
    if (clock_.due_after_step()) clock_.make_due();  // trials have overwritten P with curvature
    if (!heading.steepest) {
      ++report_.restarts.armijo;
      direction_.restart();
    } else if (advance_prescribed()) {
      ++report_.iterations;  // motion alone uses up budget too
    } else {
      double const promised = 0.5 * std::abs(heading.slope * line.newton_length());
      learn_curvature(line.known_curvature() / heading.metric, heading.solved);
      lowest_curvature_ = find_lowest_curvature();
      report_.stop = rule_.check({.decrement = promised,
                                  .attainable = promised,
                                  .curvature = lowest_curvature_,
                                  .gradient_norm = report_.gradient_norm,
                                  .floor = error_floor(),
                                  .stuck = true});
      if (!std::isfinite(step_.energy_change)) report_.stop = Stop::non_finite;
      if (report_.stop == Stop::none) report_.stop = Stop::stalled;
    }
  }

  bool advance_prescribed() {
    if (prescribed_left_) prescribed_left_ = e_.advance_prescribed(x_);
    if (!prescribed_left_) return false;
    start_travel();
    ++report_.restarts.prescribed;
    direction_.restart();
    rule_.forget();
    step_.evaluated = false;
    return true;
  }

  void start_travel() {
    if (!scale_.has_inertia) assign_on<S>(fields_.origin, x_);
    lost_energy_ = 0;
  }
  void learn_curvature(double along_p, bool solved) {
    if (!std::isfinite(along_p) || along_p <= 0) return;
    smallest_curvature_ = std::min(smallest_curvature_, along_p);
    if (!solved) stiffest_ = std::max(stiffest_, along_p);
  }
  /// Relative to the mass, along what is left to go (stopping.hpp).
  double find_lowest_curvature() const {
    if (scale_.has_inertia) return 1;
    kernels::Travel<P, S> const travel{x_, fields_.origin, fields_.mass};
    double const square = double(fields_.reducer.template sum<1>("travel", e_.size(), travel)[0]);
    double const covered = 2 * lost_energy_ / square;
    double const lowest =
        covered > 0 ? std::min(smallest_curvature_, covered) : smallest_curvature_;
    return std::isfinite(lowest) ? lowest : 0;
  }
  double error_floor() const {
    return round_off_floor(position_noise_, epsilon<typename P::real> * scale_.length, stiffest_,
                           lowest_curvature_, e_.size());
  }
  double largest_position() const {
    using Largest = kernels::LargestNorm<VectorField<typename P::position, S>>;
    return maximum<S>("largest_position", e_.size(), 0.0, Largest{x_});
  }

  E& e_;
  Positions const& x_;
  DescentFields<P, S>& fields_;
  M& preconditioner_;
  D& direction_;
  Search const& search_;
  Rule& rule_;
  Budget const& budget_;
  Safeguard const& safeguard_;
  Observer<P, S> const& observer_;
  Scale const scale_;

  RefreshClock clock_;
  Step step_;                     ///< the last one
  bool fresh_curvature_ = false;  ///< preconditioner's curvature() was filled at x
  bool prescribed_left_ = true;
  double largest_decrement_ = 0;
  double lost_energy_ = 0;  ///< since start_travel()
  double smallest_curvature_ = std::numeric_limits<double>::infinity(), stiffest_ = 0;
  double lowest_curvature_ = 1;
  double position_noise_ = 0;  ///< m
  StallWatch watch_;
  MinimiserReport report_;
};

/// A method of descent as a minimiser: directions, policies and the memory that they work on.
template <class Directions, class Preconditioner_, class LineSearch_, class Stopping_,
          class Params_>
class DescentMinimiser {
  static_assert(
      Stopping<Stopping_>,
      "taut: a minimiser's stopping rule must satisfy Stopping (integrators/stopping.hpp)");

public:
  using Precision = typename Directions::Precision;
  using Space = typename Directions::Space;
  using Positions = VectorField<typename Precision::position, Space>;
  using Params = Params_;

  DescentMinimiser() : DescentMinimiser(Params()) {}
  explicit DescentMinimiser(Params const& params)
      : params_(params),
        directions_(params),
        preconditioner_(params.preconditioner),
        line_search_(params.line_search),
        stopping_(params.stop) {}

  /// Minimises e from x, in place. Allocates if the number of unknowns has changed, and never in an
  /// iteration.
  template <Objective E>
  MinimiserReport minimise(E& e, Positions const& x,
                           Observer<Precision, Space> const& observer = {}) {
    static_assert(
        std::same_as<typename E::Precision, Precision> && std::same_as<typename E::Space, Space>,
        "taut: a minimiser and its objective must have the same Precision and Space");
    fields_.resize(e.size(), !e.scale().has_inertia);
    if (preconditioned_ != e.size()) {
      preconditioned_ = e.size();
      preconditioner_.resize(e.size());
      directions_.resize(e.size(), preconditioner_.pointwise());
    }
    if constexpr (requires { directions_.splits(e, preconditioner_, params_); }) {
      if (directions_.splits(e, preconditioner_, params_)) {
        return directions_.minimise_split(e, x, fields_, preconditioner_, line_search_, stopping_,
                                          params_, observer);
      }
    }
    return Descent(e, x, fields_, preconditioner_, directions_, line_search_, stopping_,
                   params_.budget, params_.safeguard, observer)
        .run();
  }

  Params const& params() const { return params_; }

private:
  Params params_;
  DescentFields<Precision, Space> fields_;
  int preconditioned_ = -1;  ///< unknowns that there is memory for
  Directions directions_;
  Preconditioner_ preconditioner_;
  LineSearch_ line_search_;
  Stopping_ stopping_;
};

}  // namespace taut
