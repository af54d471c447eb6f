// Nonlinear CG on all islands of a scene at a time, each as if it were alone:
//
//   p_I = -P g_I + beta_I p_I + gamma_I P y_I,   alpha_I = -g'p_I / p_I'H p_I,   d = Sum alpha_I
//   p_I,
//
// with beta_I and gamma_I from the sums over island I (Shen et al. 2024, section 4, there per
// object). Islands do not act on each other (islands.hpp), so H has no entry between two of them:
// alpha minimises the quadratic model over all of the span of the p_I, and no common step is
// better. The line search goes along d from length 1, on the energy of all, under the bound of all:
// the energy does not rise and nothing crosses, whatever the islands were taken for. (The paper's
// scheme, a step of its own for each of several objects that touch, minimises along no line.)
//
// - A bound that one island has run into shortens that island's part of d, and the two bodies that
//   met forget their past (of beta and gamma they take 0, within the island). All others go their
//   way and keep their momentum.
// - Each island stops by the same rule, on its own mass and decrements: where all have, so has the
//   scene. What has stopped is idle: no term looks at it, until something comes that may act on it.
//   An island also stops where M^-1 g says that nothing is left to gain (H >= M): bodies in flight
//   do at once.
// - Energies are measured for all together. An island is given what its model predicts, and more
//   where more was measured than all models predict.
//
// Measured on eight letters E at half resolution, the first 42 steps (from free flight to the pile
// of the lower four): 261 iterations instead of 488, on 40 % of the work (iterations times the
// share of unknowns that they worked on); where letters touch the counts are alike, 17 to 23. On
// the 45 balls of the funnel, in flight: 11 iterations instead of 101. A pile is one island, and
// costs what it did.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/integrators/island_ledger.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace taut {

template <class E, class B, class M, class Search, class Rule>
requires DivisibleObjective<E> && Preconditioner<M, E> && LineSearch<Search, E> && Stopping<Rule>
class IslandDescent {
public:
  using P = typename E::Precision;
  using S = typename E::Space;
  using Positions = VectorField<typename P::position, S>;

  IslandDescent(E& e, Positions const& x, DescentFields<P, S>& fields, Islands<P, S>& islands,
                M& preconditioner, B const& beta, Search const& search, Rule& rule,
                Budget const& budget, Safeguard const& safeguard, Observer<P, S> const& observer)
      : e_(e),
        x_(x),
        fields_(fields),
        islands_(islands),
        preconditioner_(preconditioner),
        beta_(beta),
        search_(search),
        rule_(rule),
        budget_(budget),
        safeguard_(safeguard),
        observer_(observer),
        scale_(e.scale()),
        clock_(preconditioner.refresh()),
        ledger_(e, islands, rule, position_noise(x)),
        past_(ledger_.count()),
        report_(ledger_.report()) {}

  MinimiserReport run() {
    Kokkos::Timer const timer;
    struct Awakening {  // however it ends
      E& e;
      ~Awakening() { e.set_idle({}); }
    } const awakening{e_};
    fields_.mass = e_.mass();
    rule_.start(scale_);
    while (report_.stop == Stop::none) {
      if (report_.iterations >= budget_.max_iterations) {
        report_.stop = Stop::budget_iterations;
      } else if (timer.seconds() >= budget_.max_seconds) {
        report_.stop = Stop::budget_seconds;
      } else {
        iterate();
      }
    }
    ledger_.say_who_slept();
    if (report_.iterations == 0) report_.active = 1;
    report_.error_floor_m = ledger_.error_floor();
    report_.error_estimate_m = std::max(ledger_.error(), report_.error_floor_m);
    report_.error_estimate_mps = report_.error_estimate_m / scale_.time_step;
    report_.seconds = timer.seconds();
    return report_;
  }

private:
  using Turn = kernels::Turn;
  template <class T>
  static constexpr double epsilon = double(Kokkos::Experimental::epsilon_v<T>);
  static double position_noise(Positions const& x) {
    return epsilon<typename P::position> *
           maximum<S>("largest_position", x.extent_int(0), 0.0, kernels::LargestNorm<Positions>{x});
  }

  void iterate() {
    if (ledger_.regroup(x_)) forget_gradient();
    ledger_.set_idle();
    if (!ledger_.any_works()) {
      if (advance_prescribed()) return void(++report_.iterations);  // motion uses up budget too
      report_.stop = ledger_.verdict();
      return;
    }
    measure();
    if (!aim()) {
      if (report_.iterations > 0) assign_on<S>(x_, fields_.from);
      report_.stop = Stop::non_finite;
    } else if (ledger_.any_works()) {
      step();
    }
  }
  /// Nor is curvature known.
  void forget_gradient() {
    step_.evaluated = false;
    clock_.make_due();
  }

  /// Gradient and preconditioner at x, as far as they are not known.
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
    if (!clock_.due()) return;
    preconditioner_.update(e_, x_);
    clock_.updated();
    ++report_.refreshes;
  }

  /// d, and all that is known of it; false if that is not a number.
  bool aim() {
    products();
    double gradient = 0;
    bool finite = true;
    ledger_.for_each_working([&](Island& island) {
      finite = finite && std::isfinite(island.descent);
      gradient += island.gradient;
      if (finite && !ledger_.ends_by_gradient(island)) weigh(island);
    });
    if (!finite) return false;
    report_.gradient_norm = std::sqrt(gradient / scale_.mass);
    direct(Turn::renew);
    bool uphill = false;
    ledger_.for_each_working([&](Island& island) {
      bool const descends = island.direction <= -safeguard_.least_descent * island.descent;
      if (!safeguard_.on || island.steepest || descends) return;
      ++report_.restarts.not_descent;
      island.restarted = island.steepest = uphill = true;
    });
    if (uphill) direct(Turn::keep);
    for (int b = 0; b < ledger_.count(); ++b) ledger_.remember_body(b);
    return lengths();
  }

  /// P g and P y, as P is pointwise.
  kernels::PreconditionedGradient<P, S> preconditioned() const {
    return {fields_.gradient, fields_.gradient_before, preconditioner_.curvature(), {}, {}};
  }
  /// Scalar products of each island; those that betas are made of, of the bodies that keep their
  /// last direction, at both ends of the step, whatever island they were of.
  void products() {
    using Dot = kernels::ConjugateDots<P, S>;
    auto const sums = islands_.sums().template sum<Dot::count>(
        "island_dots", Dot{preconditioned(), fields_.direction, fields_.mass});
    ledger_.for_each_working([&](Island& island) {
      island.dots = {.alpha = island.factor * step_.length};
      island.descent = island.gradient = 0;
      island.steepest = true;
    });
    ledger_.for_each_working_body([&](int b, Island& island) {
      auto const of = [&](int k) { return double(sums[std::size_t(Dot::count) * b + k]); };
      Dots& d = island.dots;
      Dots const last = std::exchange(past_[b], {.g_P_g = of(Dot::g_P_g), .g_g = of(Dot::g_g)});
      island.descent += of(Dot::g_P_g);
      island.gradient += of(Dot::g_Minv_g);
      if (ledger_.fresh(b)) return;
      island.steepest = false;
      d.g_P_g += last.g_P_g;
      d.g_g += last.g_g;
      d.g_p += last.g_p;
      d.p_p += last.p_p;
      d.g1_P1_g1 += of(Dot::g_P_g);
      d.g1_g1 += of(Dot::g_g);
      d.g1_P1_y += of(Dot::g_P_y);
      d.y_P1_y += of(Dot::y_P_y);
      d.g_P1_g += of(Dot::before_P_before);
      d.g1_p += of(Dot::g_p) / island.factor;
      d.y_p += of(Dot::y_p) / island.factor;
    });
  }

  /// How much of its last direction an island keeps.
  void weigh(Island& island) {
    Coefficients kept;
    if (!island.steepest) {
      kept = beta_(island.dots);
      bool const finite = std::isfinite(kept.beta) && std::isfinite(kept.gamma);
      if (safeguard_.on && (island.dots.y_p <= 0 || !finite)) {
        kept = {};
        ++report_.restarts.curvature;
      }
    }
    island.beta = kept.beta / island.factor;  // the field holds factor p
    island.gamma = kept.gamma;
    island.steepest = kept.beta == 0 && kept.gamma == 0;
    island.restarted = island.restarted || island.steepest;
  }

  /// p of all islands, or (`others` keep theirs) of those that have just been restarted.
  void direct(Turn others) {
    for (int b = 0; b < ledger_.count(); ++b) {
      Island const& island = ledger_.of_body(b);
      bool const renewed = others == Turn::renew || island.restarted;
      islands_.set_turn(b, !island.works() ? Turn::rest : renewed ? Turn::renew : others);
      islands_.beta(b) = typename P::real(ledger_.fresh(b) ? 0 : island.beta);
      islands_.gamma(b) = typename P::real(ledger_.fresh(b) ? 0 : island.gamma);
    }
    islands_.send_turns();
    using Update = kernels::IslandDirection<P, S>;
    auto const sums = islands_.sums().template sum<Update::count>(
        "island_direction", Update{preconditioned(), fields_.direction, fields_.mass,
                                   islands_.bodies().of, islands_.turns()});
    ledger_.for_each_working([](Island& island) { island.direction = island.metric = 0; });
    ledger_.for_each_working_body([&](int b, Island& island) {
      auto const of = [&](int k) { return double(sums[std::size_t(Update::count) * b + k]); };
      past_[b].g_p = of(Update::g_p);
      past_[b].p_p = of(Update::p_p);
      island.direction += of(Update::g_p);
      island.metric += of(Update::p_M_p);
    });
  }

  /// d = Sum alpha_I p_I; false if that is not a number.
  bool lengths() {
    e_.form_shares(x_, fields_.direction, islands_.shares());
    auto const shares = islands_.wide_sums().template sum<1>(
        "island_form", kernels::SumShares<S>{islands_.shares()});
    ledger_.for_each_working([](Island& island) { island.form = 0; });
    ledger_.for_each_working_body([&](int b, Island& island) { island.form += shares[b]; });
    slope_ = form_ = 0;
    bool finite = true;
    ledger_.for_each_working([&](Island& island) {
      finite = finite && std::isfinite(island.direction) && std::isfinite(island.form);
      // With inertia p'Hp >= p'Mp, unless that is lost to round-off.
      double const curvature = std::max(island.form, island.metric);
      island.restarted = island.cut = false;
      island.stiffest = std::max(island.stiffest, curvature / island.metric);
      island.factor = double(typename P::real(-island.direction / curvature));
      island.slope = island.factor * island.direction;
      island.form = island.factor * island.factor * curvature;
      island.attainable = -0.5 * island.slope;
      slope_ += island.slope;
      form_ += island.form;
    });
    for (int b = 0; b < ledger_.count(); ++b) {
      Island const& island = ledger_.of_body(b);
      islands_.factor(b) = island.works() ? typename P::real(island.factor) : 0;
    }
    scale_direction();
    return finite && std::isfinite(slope_);
  }
  void scale_direction() {
    islands_.send_factors();
    for_each<S>("scale_bodies", e_.size(),
                kernels::ScaleBodies<P, S>{fields_.direction, islands_.bodies().of,
                                           islands_.turns().factor});
  }

  /// Shortens the part of each island that has run into a bound, so that the others need not stop
  /// there; returns how far d is known to be valid. One island alone is left to the line search.
  double confine() {
    constexpr int most = 8;
    double const fraction = bound_fraction(), wanted = 1 / fraction;
    if (!std::isfinite(fraction)) return 0;  // the line search asks for no bound
    int moving = 0;
    ledger_.for_each_working([&](Island const& island) { moving += island.slope != 0; });
    for (int round = 0; moving > 1 && round < most; ++round) {
      double const reach = e_.max_step(x_, fields_.direction, wanted);
      if (reach >= wanted) return wanted;
      Island* const island = forget_obstructed();
      if (!island) return 0;
      // A little less, for a bound is not found exactly.
      double const share = double(typename P::real(0.999 * fraction * reach));
      if (!island->cut) ++report_.cuts, report_.restarts.cut += safeguard_.on;
      island->cut = true;
      slope_ -= (1 - share) * island->slope;
      form_ -= (1 - share * share) * island->form;
      island->slope *= share;
      island->form *= share * share;
      island->factor *= share;
      for (int b = 0; b < ledger_.count(); ++b) {
        islands_.factor(b) = typename P::real(&ledger_.of_body(b) == island ? share : 1);
      }
      scale_direction();
    }
    return 0;
  }
  /// The share of a bound that the line search goes.
  double bound_fraction() const {
    if constexpr (requires { search_.bound(); }) return search_.bound().fraction;
    return StepBound().fraction;
  }
  /// Of what the last bound was cut by, the bodies forget their past; their island, if that is
  /// known.
  Island* forget_obstructed() {
    auto const by = e_.obstruction();
    Island* island = nullptr;
    if (!by) return island;
    for (int i : by->unknowns) {
      int const b = islands_.body_of(i);
      if (!ledger_.of_body(b).works() || ledger_.of_body(b).slope == 0) continue;
      island = &ledger_.of_body(b);
      if (safeguard_.on) ledger_.forget_body(b);
    }
    return island;
  }

  void step() {
    double const valid = confine();
    bool const curvature_due = clock_.due_after_step();
    Line<E> line(e_, x_, fields_,
                 curvature_due ? preconditioner_.curvature() : LocalMatrices<P, S>(), slope_,
                 largest_decrement_, rule_.negligible());
    line.know_valid(valid);
    step_ = {.found = false};  // where all are parked by a bound
    if (slope_ < 0) step_ = search_(line, 1.0);
    report_.backtracks += step_.backtracks;
    report_.cuts += step_.cut;
    if (!step_.found) return give_up();

    std::swap(fields_.gradient, fields_.gradient_before);
    fresh_curvature_ = step_.evaluated && curvature_due;
    clock_.stepped(step_.length);
    double const decrement = -step_.energy_change;
    largest_decrement_ = std::max(largest_decrement_, decrement);
    report_.energy_change += step_.energy_change;
    watch_.stepped(step_.energy_change);
    ledger_.judge(step_, decrement);
    if (safeguard_.on && step_.cut) {
      ++report_.restarts.cut;
      if (!forget_obstructed()) {
        ledger_.for_each_working([](Island& island) { island.restarted = true; });
      }
    }
    if (observer_) observe();
    ++report_.iterations;
    if (advance_prescribed() || !ledger_.any_works()) return;
    double const noise = 16 * epsilon<typename P::real> * largest_decrement_;
    report_.stop = watch_.check(report_.iterations, noise);
  }
  void observe() {
    double beta = 0, gamma = 0;
    ledger_.for_each_working([&](Island const& island) {
      beta = std::max(beta, island.beta);
      gamma = std::max(gamma, island.gamma);
    });
    observer_({report_.iterations, x_, step_.length, beta, gamma, slope_, form_,
               step_.energy_change, report_.energy_change, report_.gradient_norm, ledger_.error()});
  }

  /// No step along d was good enough. If all were along -P g, that is the end.
  void give_up() {
    step_.evaluated = false;
    if (clock_.due_after_step()) clock_.make_due();  // trials have overwritten P with curvature
    bool steepest = true;
    ledger_.for_each_working([&](Island& island) {
      steepest = steepest && island.steepest;
      island.restarted = true;
      if (!(std::abs(island.factor) > 0)) island.factor = 1;
    });
    if (!steepest) {
      ++report_.restarts.armijo;
    } else if (advance_prescribed()) {
      ++report_.iterations;
    } else if (!std::isfinite(step_.energy_change)) {
      report_.stop = Stop::non_finite;
    } else {
      ledger_.end_stuck();
      report_.stop = ledger_.verdict();
    }
  }

  bool advance_prescribed() {
    if (prescribed_left_) prescribed_left_ = e_.advance_prescribed(x_);
    if (!prescribed_left_) return false;
    ++report_.restarts.prescribed;
    ledger_.wake_all();
    forget_gradient();
    return true;
  }

  E& e_;
  Positions const& x_;
  DescentFields<P, S>& fields_;
  Islands<P, S>& islands_;
  M& preconditioner_;
  B const& beta_;
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
  double slope_ = 0, form_ = 0;  ///< g'd, d'Hd
  double largest_decrement_ = 0;
  StallWatch watch_;
  IslandLedger<E, Rule> ledger_;
  std::vector<Dots> past_;  ///< per body: where its last step began
  MinimiserReport& report_;
};

}  // namespace taut
