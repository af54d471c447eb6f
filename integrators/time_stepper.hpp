// Time integrators: each step is one minimisation of an incremental potential
//   E(x) = 1/2 |x - x~|^2_M + c h^2 V(x),
// where the rule says x~, c and the new velocity:
//
//   implicit Euler: x~ = x + h v,                        c = 1,    v+ = (x+ - x) / h
//
//   BDF2:           x~ = a x - b x- + d h (a v - b v-),  c = d^2,  v+ = (x+ - a x + b x-) / (d h)
//
//   quasi-static:   no inertia,                          c = 1,    v+ = 0
//
// With r the ratio of this step to the last one, BDF2 has a = (1 + r)^2 / (1 + 2r), b = r^2 / (1 +
// 2r) and d = (1 + r) / (1 + 2r): 4/3, 1/3 and 2/3 while h does not change.
//
// Body forces are part of V. The minimisation starts from the predictor, the minimum of all terms
// but the swept ones (x + h v + h^2 g for implicit Euler), or nearer to a rigid motion of each body
// (rigid_predictor.hpp); vertices and pins go there together, as far as no element of a pinned body
// folds, and the minimiser carries what is left of the pins' motion through its iterations.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/growing.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/potential/local_terms.hpp>
#include <taut/core/potential/objective.hpp>
#include <taut/core/report/error.hpp>
#include <taut/integrators/report.hpp>
#include <taut/integrators/rigid_predictor.hpp>
#include <taut/integrators/sleep.hpp>

#include <cmath>

namespace taut {

/// Position and velocity of all unknowns, now and one step ago. Owned by the user; a step
/// overwrites it. Everything that a restarted run needs.
template <class Precision = Mixed, class Space = DefaultSpace>
struct State {
  using Positions = VectorField<typename Precision::position, Space>;

  Positions x, v;            ///< m, m/s
  Positions x_last, v_last;  ///< at the step before (multistep rules)
  double time = 0;           ///< s
  double last_step = 0;      ///< length of the step before, s; 0: there was none
  int steps = 0;             ///< taken so far

  State() = default;
  explicit State(int n) : x("x", n), v("v", n), x_last("x_last", n), v_last("v_last", n) {}
  /// At rest at these positions.
  explicit State(Positions const& at) : State(static_cast<int>(at.extent(0))) { assign(x, at); }
  int size() const { return static_cast<int>(x.extent(0)); }
};

/// x~ = a0 x + a1 x- + h (b0 v + b1 v-);  v+ = (c x+ + c0 x + c1 x-) / h;  scale h^2.
struct StepCoefficients {
  double a0, a1, b0, b1, c, c0, c1, scale;
};

/// A rule: `coefficients` for a step that is `ratio` times as long as the last one.
struct ImplicitEulerRule {
  static constexpr char const* name = "implicit_euler";
  static constexpr bool inertia = true;
  static constexpr bool multistep = false;
  static constexpr StepCoefficients coefficients(double) { return {1, 0, 1, 0, 1, -1, 0, 1}; }
};

/// Second order; its first step is one of implicit Euler. Steps may shrink at will; growing by more
/// than 1 + sqrt(2) time and again is unstable (Grigorieff 1983).
struct Bdf2Rule {
  static constexpr char const* name = "bdf2";
  static constexpr bool inertia = true;
  static constexpr bool multistep = true;
  static constexpr StepCoefficients coefficients(double ratio) {
    double const unit = 1 + 2 * ratio, d = (1 + ratio) / unit;
    double const a = (1 + ratio) * (1 + ratio) / unit, b = ratio * ratio / unit;
    return {a, -b, d * a, -d * b, 1 / d, -a / d, b / d, d * d};
  }
};

struct QuasiStaticRule {
  static constexpr char const* name = "quasi_static";
  static constexpr bool inertia = false;
  static constexpr bool multistep = false;
  static constexpr StepCoefficients coefficients(double) { return {1, 0, 0, 0, 0, 0, 0, 1}; }
};

namespace kernels {

template <class Precision, class Space>
struct InertialTarget {
  using Position = typename Precision::position;
  using Positions = VectorField<Position, Space>;
  State<Precision, Space> state;
  Positions target, x;
  double a0, a1, hb0, hb1;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) {
      double t = a0 * double(state.x(i, c)) + hb0 * double(state.v(i, c));
      if (a1 != 0) t += a1 * double(state.x_last(i, c)) + hb1 * double(state.v_last(i, c));
      target(i, c) = static_cast<Position>(t);
      x(i, c) = target(i, c);
    }
  }
};

/// Direction from the state to the predictor; pins go to where they are to be.
template <class Precision, class Space>
struct StartDirection {
  using Real = typename Precision::real;
  FixedMask<Space> fixed;
  VectorField<typename Precision::position, Space> from, predictor, prescribed;
  VectorField<Real, Space> direction;
  KOKKOS_FUNCTION void operator()(int i, double& prescribed_motion) const {
    for (int c = 0; c < 3; ++c) {
      double const to = fixed(i) ? double(prescribed(i, c)) : double(predictor(i, c));
      double const d = to - double(from(i, c));
      direction(i, c) = static_cast<Real>(d);
      if (fixed(i)) prescribed_motion = Kokkos::max(prescribed_motion, Kokkos::abs(d));
    }
  }
};

/// Goes along the direction that the bound was of: in mixed precision that is not quite the way to
/// the predictor. Pins land exactly.
template <class Precision, class Space>
struct Start {
  using Position = typename Precision::position;
  using Real = typename Precision::real;
  FixedMask<Space> fixed;
  VectorField<Position, Space> from, prescribed, x;  ///< x holds the predictor
  VectorField<Real, Space> direction;
  double fraction;
  KOKKOS_FUNCTION void operator()(int i) const {
    constexpr bool rounded = sizeof(Real) < sizeof(Position);
    for (int c = 0; c < 3; ++c) {
      if (fraction < 1 || (rounded && !fixed(i))) {
        x(i, c) = static_cast<Position>(double(from(i, c)) + fraction * double(direction(i, c)));
      } else if (fixed(i)) {
        x(i, c) = prescribed(i, c);
      }
    }
  }
};

template <class Precision, class Space>
struct FinishStep {
  using Position = typename Precision::position;
  State<Precision, Space> state;
  VectorField<Position, Space> x;
  double c_h, c0_h, c1_h;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) {
      double v = c_h * double(x(i, c)) + c0_h * double(state.x(i, c));
      if (c1_h != 0) v += c1_h * double(state.x_last(i, c));
      state.x_last(i, c) = state.x(i, c);
      state.v_last(i, c) = state.v(i, c);
      state.x(i, c) = x(i, c);
      state.v(i, c) = static_cast<Position>(v);
    }
  }
};

}  // namespace kernels

/// What terms take from the start of a step instead of following x within it (the normal forces and
/// tangent planes of friction) may be taken anew where the minimisation ended, and the step be
/// minimised again: a fixed point, `passes` minimisations in all.
struct Lagging {
  int passes = 1;
};

template <class Rule, class Minimiser>
class TimeStepper {
public:
  using Precision = typename Minimiser::Precision;
  using Space = typename Minimiser::Space;
  using Positions = VectorField<typename Precision::position, Space>;
  using Params = typename Minimiser::Params;
  using StateType = State<Precision, Space>;
  static constexpr bool multistep = Rule::multistep;

  TimeStepper() = default;
  /// Throws Error unless there is at least one pass, and where sleep makes no sense.
  explicit TimeStepper(Params const& params, Lagging const& lagging = {},
                       typename Sleep<Precision, Space>::Params const& sleep = {},
                       typename RigidPredictor<Precision, Space>::Params const& rigid = {})
      : minimiser_(params), lagging_(lagging), sleep_(sleep), rigid_predictor_(rigid) {
    if (lagging.passes < 1) {
      throw Error("a time step of {} minimisations: give 1 pass or more", lagging.passes);
    }
  }

  /// Advances the state by h seconds and returns the minimiser's report. Pins go to
  /// potential.unknowns().prescribed, which the caller has set for the end of the step. The state
  /// is left as it was if the step throws or ends in Stop::non_finite.
  template <class Potential>
  auto step(Potential& potential, State<Precision, Space>& state, double h,
            Observer<Precision, Space> const& observer = {}) {
    if (Rule::multistep && state.last_step == 0) {
      return advance<ImplicitEulerRule>(potential, state, h, observer);
    }
    return advance<Rule>(potential, state, h, observer);
  }

  Minimiser& minimiser() { return minimiser_; }
  /// Who sleeps; its record belongs to a checkpoint.
  Sleep<Precision, Space>& sleep() { return sleep_; }
  Sleep<Precision, Space> const& sleep() const { return sleep_; }
  /// Where the last minimisation ended, m: what the state is now, unless the step was refused.
  Positions const& reached() const { return x_; }

private:
  template <class R, class Potential>
  auto advance(Potential& potential, State<Precision, Space>& state, double h,
               Observer<Precision, Space> const& observer) {
    int const n = state.size();
    StepCoefficients const r = R::coefficients(R::multistep ? h / state.last_step : 1);
    if (static_cast<int>(x_.extent(0)) != n) {
      x_ = x_memory_.resize("step_x", n);
      direction_ = direction_memory_.resize("step_direction", n);
    }
    auto& inertia = potential.template term<Inertia<Precision, Space>>();
    inertia.switch_on(R::inertia);
    auto const aim = [&] {
      for_each<Space>("inertial_target", n,
                      kernels::InertialTarget<Precision, Space>{state, inertia.target(), x_, r.a0,
                                                                r.a1, h * r.b0, h * r.b1});
    };
    double const time_step = h * std::sqrt(r.scale);
    aim();
    potential.begin_step(state.x, r.scale * (R::inertia ? h * h : 1.0), time_step, R::inertia);
    potential.predict(x_);
    if (R::inertia) {
      sleep_.lie(potential, state.x, x_, time_step);
      rigid_predictor_.start(potential, state, x_);
    }
    start(potential, state);
    auto report = minimiser_.minimise(potential, x_, observer);
    for (int pass = 1; pass < lagging_.passes && report.stop != Stop::non_finite; ++pass) {
      if (!potential.relag(x_)) break;
      report = in_sequence(report, minimiser_.minimise(potential, x_, observer));
    }
    if (report.stop == Stop::non_finite) return report;
    for_each<Space>("finish_step", n,
                    kernels::FinishStep<Precision, Space>{state, x_, r.c / h, r.c0 / h, r.c1 / h});
    if (R::inertia) {
      bool predicted = false;
      sleep_.settle(potential, state, time_step, [&] {
        predicted = true;
        aim();
        potential.predict(x_);
        return x_;
      });
      if (predicted) assign_on<Space>(x_, state.x);  // what has been reached, again
    }
    Kokkos::fence("taut: step");
    state.time += h;
    state.last_step = h;
    ++state.steps;
    return report;
  }

  template <class Potential>
  void start(Potential& potential, State<Precision, Space>& state) {
    auto const& unknowns = potential.unknowns();
    double const moved =
        maximum<Space>("start_direction", state.size(), 0.0,
                       kernels::StartDirection<Precision, Space>{unknowns.fixed, state.x, x_,
                                                                 unknowns.prescribed, direction_});
    bool const prescribed = moved > 0 || potential.motion_left(state.x) > 0;
    double fraction = potential.max_step(state.x, direction_, 1.0);
    if (prescribed) fraction = potential.max_prescribed_step(state.x, direction_, fraction);
    for_each<Space>("start", state.size(),
                    kernels::Start<Precision, Space>{unknowns.fixed, state.x, unknowns.prescribed,
                                                     x_, direction_, fraction});
    if (prescribed) potential.advance(fraction);
  }

  Minimiser minimiser_;
  Lagging lagging_;
  Sleep<Precision, Space> sleep_;
  RigidPredictor<Precision, Space> rigid_predictor_;
  Positions x_;
  VectorField<typename Precision::real, Space> direction_;
  Resizable<Positions> x_memory_;
  Resizable<VectorField<typename Precision::real, Space>> direction_memory_;
};

template <class Minimiser>
using ImplicitEuler = TimeStepper<ImplicitEulerRule, Minimiser>;
template <class Minimiser>
using Bdf2 = TimeStepper<Bdf2Rule, Minimiser>;
template <class Minimiser>
using QuasiStatic = TimeStepper<QuasiStaticRule, Minimiser>;

}  // namespace taut
