// What a minimiser by islands (island_descent.hpp) knows of each of them, which work, and which
// have ended. On the host: a few numbers per body.
#pragma once

#include <taut/integrators/beta.hpp>
#include <taut/integrators/descent.hpp>
#include <taut/integrators/islands.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace taut {

struct Island {
  int bodies = 0;  ///< 0: it is part of another
  int unknowns = 0;
  double mass = 0;         ///< of what is free, kg
  Stop stop = Stop::none;  ///< none: it is at work
  double error = 0;        ///< m, where it has stopped

  Dots dots;             ///< of those of its bodies that keep their past
  double descent = 0;    ///< g'Pg
  double gradient = 0;   ///< g' M^-1 g
  double direction = 0;  ///< g'p
  double beta = 0, gamma = 0;
  bool restarted = true;       ///< the past of all of its bodies is forgotten
  bool steepest = true;        ///< p = -P g on all of them
  double factor = 1;           ///< d = factor p
  double slope = 0, form = 0;  ///< g'd, d'Hd
  double metric = 0;           ///< p'Mp
  double attainable = 0;       ///< what its part of d would gain uncut
  bool cut = false;            ///< a bound has shortened its part of d
  double stiffest = 0;         ///< the largest p'Hp / p'Mp

  bool works() const { return bodies > 0 && stop == Stop::none; }
  /// What the quadratic model says of a step by `length`.
  double predicted(double length) const { return -length * (slope + 0.5 * length * form); }
};

template <class E, class Rule>
class IslandLedger {
public:
  using P = typename E::Precision;
  using S = typename E::Space;
  using Positions = VectorField<typename P::position, S>;

  /// Every body is an island, but those that sleep are at rest.
  IslandLedger(E& e, Islands<P, S>& islands, Rule const& rule, double position_noise)
      : e_(e),
        islands_(islands),
        scale_(e.scale()),
        position_noise_(position_noise),
        asleep_(e.asleep()) {
    auto const free = islands.wide_sums().template sum<2>(
        "island_mass", kernels::SumFree<P, S>{e.fixed(), e.mass()});
    int const count = islands.count();
    islands.start();
    body_.resize(count);
    for (int b = 0; b < count; ++b) {
      body_[b] = {.mass = free[2 * b], .unknowns = int(free[2 * b + 1])};
      body_[b].awake = asleep_.empty() || !asleep_[b];
      unknowns_ += body_[b].unknowns;
    }
    island_.assign(count, {});
    rules_.assign(count, rule);
    for (Rule& own : rules_) own.start(scale_);
    found(std::vector<char>(count, 1));
    report_.bodies = count;
    report_.islands = 0;
    report_.active = 0;
  }

  int count() const { return islands_.count(); }
  Island& operator[](int i) { return island_[i]; }
  Rule const& rule(int i) const { return rules_[i]; }
  Island& of_body(int b) { return island_[islands_(b)]; }
  /// The past of body b is forgotten.
  bool fresh(int b) { return of_body(b).restarted || body_[b].fresh; }
  void forget_body(int b) { body_[b].fresh = true; }
  void remember_body(int b) { body_[b].fresh = false; }
  /// Counts and shares of a report.
  MinimiserReport& report() { return report_; }

  template <class Visit>
  void for_each_working(Visit const& visit) {
    for (Island& island : island_) {
      if (island.works()) visit(island);
    }
  }
  template <class Visit>
  void for_each_working_body(Visit const& visit) {
    for (int b = 0; b < count(); ++b) {
      if (of_body(b).works()) visit(b, of_body(b));
    }
  }
  bool any_works() const {
    return std::any_of(island_.begin(), island_.end(), [](Island const& i) { return i.works(); });
  }

  /// Joins islands that may act on each other at x, and wakes what is idle among them; true if
  /// there was something: its gradient is not known.
  bool regroup(Positions const& x) {
    bool const woken = islands_.regroup(e_, x) && merge();
    int alive = 0;
    for (Island const& i : island_) alive += i.bodies > 0 && i.unknowns > 0;
    report_.islands = std::max(report_.islands, alive);
    return woken;
  }

  /// Tells the terms what is idle, if that is news.
  void set_idle() {
    bool news = !told_;
    bool const others = any_works();
    for (int b = 0; b < count(); ++b) {
      bool const works = of_body(b).works();
      bool const leaves = others && body_[b].awake && !works && islands_(b) == b;
      report_.left += leaves && body_[b].unknowns > 0;
      news = news || works != body_[b].awake;
      body_[b].awake = works;
      islands_.set_turn(b, works ? kernels::Turn::renew : kernels::Turn::rest);
    }
    if (news) e_.set_idle(islands_.idle());
    told_ = true;
  }

  /// All is to be judged anew: something has moved by script.
  void wake_all() {
    std::fill(asleep_.begin(), asleep_.end(), 0);
    for (int i = 0; i < count(); ++i) {
      if (island_[i].bodies == 0) continue;
      if (island_[i].unknowns > 0) island_[i].stop = Stop::none;
      island_[i].restarted = true;
      rules_[i].forget();
    }
  }

  /// An island that has nothing to gain has ended; true then.
  bool ends_by_gradient(Island& island) {
    double const least = rules_[&island - island_.data()].negligible();
    if (island.descent > 0 && 0.5 * island.gradient > least) return false;
    island.stop = Stop::converged_by_gradient;
    island.error = std::sqrt(island.gradient / island.mass);
    return true;
  }

  /// What a step, which gained `decrement` in all, was for each island, and whether that was its
  /// last. An island is given what its model predicts, and more if all gained more than predicted.
  void judge(Step const& step, double decrement) {
    double predicted = 0;
    int working = 0;
    for_each_working([&](Island const& island) {
      predicted += island.predicted(step.length);
      working += island.unknowns;
    });
    double const more = predicted > 0 ? std::clamp(decrement / predicted, 1.0, 4.0) : 1;
    double const share = double(working) / unknowns_;
    report_.active += (share - report_.active) / ++steps_;
    bool const backtracked = step.backtracks > 0;
    for_each_working([&](Island& island) {
      bool const cut = island.cut || step.cut;
      double const gained = more * island.predicted(step.length);
      Progress progress = progress_of(island, gained);
      if (cut || backtracked) progress.attainable = std::max(gained, island.attainable);
      progress.shortened = backtracked;
      // Parked by a bound, and no other way down.
      progress.stuck = island.slope == 0 && island.steepest;
      check(island, progress);
      if (island.slope == 0) island.factor = 1, island.restarted = true;
    });
  }
  /// No step is possible any more.
  void end_stuck() {
    for_each_working([&](Island& island) {
      Progress progress = progress_of(island, island.attainable);
      progress.stuck = true;
      check(island, progress);
    });
  }

  /// Converged if all are.
  Stop verdict() const {
    Stop last = Stop::converged_by_gradient;
    for (Island const& i : island_) {
      if (i.bodies == 0) continue;
      if (i.stop == Stop::stalled) return Stop::stalled;
      if (i.stop != Stop::converged_by_gradient) last = i.stop;
    }
    return last;
  }
  /// Of all together, m; and the largest floor.
  double error() const {
    double square = 0;
    for (int i = 0; i < count(); ++i) {
      Island const& island = island_[i];
      if (island.bodies == 0 || island.unknowns == 0) continue;
      double const own = island.works() ? rules_[i].error_estimate() : island.error;
      square += island.mass * own * own;
    }
    return square > 0 ? std::sqrt(square / scale_.mass) : 0;
  }
  double error_floor() const {
    double floor = 0;
    for (Island const& i : island_) {
      if (i.bodies > 0) floor = std::max(floor, floor_of(i));
    }
    return floor;
  }
  /// Says in the report, and to the objective, who has slept through all.
  void say_who_slept() {
    if (asleep_.empty()) return;
    for (int b = 0; b < count(); ++b) report_.asleep += asleep_[b] && body_[b].unknowns > 0;
    e_.set_asleep(asleep_);
  }

private:
  struct Body {
    double mass = 0;
    int unknowns = 0;    ///< that are free
    bool awake = true;   ///< terms look at it
    bool fresh = false;  ///< its past is forgotten
  };

  /// Counts what the islands that have `changed` consist of, and begins anew to judge them.
  void found(std::vector<char> const& changed) {
    std::vector<char> sleeps(count(), !asleep_.empty());
    for (int i = 0; i < count(); ++i) {
      if (!changed[i]) continue;
      island_[i].bodies = island_[i].unknowns = 0;
      island_[i].mass = island_[i].error = 0;
    }
    for (int b = 0; b < count(); ++b) {
      int const i = islands_(b);
      if (!changed[i]) continue;
      ++island_[i].bodies;
      island_[i].mass += body_[b].mass;
      island_[i].unknowns += body_[b].unknowns;
      sleeps[i] = sleeps[i] && asleep_[b];
    }
    for (int i = 0; i < count(); ++i) {
      if (!changed[i]) continue;
      Scale own = scale_;
      own.mass = island_[i].mass;
      resume_rule(rules_[i], own);
      // What has nothing free is done, and so is what sleeps.
      bool const done = island_[i].unknowns == 0 || sleeps[i];
      island_[i].stop = done ? Stop::converged_by_gradient : Stop::none;
    }
  }

  bool merge() {
    std::vector<char> changed(count(), 0), wakes(count(), 0);
    for (int b = 0; b < count(); ++b) {
      int const i = islands_(b), before = islands_.previous(b);
      wakes[i] = wakes[i] || asleep_.empty() || !asleep_[b];
      if (i == before) continue;
      changed[i] = 1;
      // Both have their last direction, but each by a factor of its own: one is kept.
      if (island_[before].factor != island_[i].factor) body_[b].fresh = true;
      if (island_[before].bodies > 0) join_rule(rules_[i], rules_[before]);
      island_[before].bodies = 0;
    }
    bool woken = false;
    for (int b = 0; b < count(); ++b) {
      int const i = islands_(b);
      if (!changed[i] || !wakes[i] || body_[b].awake) continue;
      if (!asleep_.empty()) asleep_[b] = 0;
      woken = body_[b].fresh = true;
      report_.woken += islands_.previous(b) == b && body_[b].unknowns > 0;
    }
    found(changed);
    return woken;
  }

  Progress progress_of(Island const& island, double gained) const {
    return {.decrement = gained,
            .attainable = gained,
            .gradient_norm = std::sqrt(island.gradient / island.mass),
            .floor = floor_of(island)};
  }
  void check(Island& island, Progress const& progress) {
    Rule& rule = rules_[&island - island_.data()];
    island.stop = rule.check(progress);
    island.error = rule.error_estimate();
    if (progress.stuck && island.works()) island.stop = Stop::stalled;
  }
  double floor_of(Island const& island) const {
    double const edges = double(Kokkos::Experimental::epsilon_v<typename P::real>) * scale_.length;
    return round_off_floor(position_noise_, edges, island.stiffest, 1,
                           std::max(island.unknowns, 1));
  }

  E& e_;
  Islands<P, S>& islands_;
  Scale const scale_;
  double position_noise_;  ///< m
  int unknowns_ = 0;       ///< that are free
  int steps_ = 0;
  bool told_ = false;  ///< terms know what is idle
  std::vector<Body> body_;
  std::vector<Island> island_;  ///< by their smallest body
  std::vector<Rule> rules_;     ///< likewise
  std::vector<char> asleep_;    ///< per body, or empty: see DivisibleObjective
  MinimiserReport report_;
};

}  // namespace taut
