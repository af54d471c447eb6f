// Sleep: bodies that have come to rest leave the steps.
//
// An island whose bodies have all been slower than a speed for some steps falls asleep. What sleeps
// stays where it is, with velocity zero, and no term looks at it. It wakes, and takes part in the
// very minimisation,
//   - as soon as it may come to act on something awake (candidates of contact join islands, whether
//     they act or not, so nothing is pushed before it is woken);
//   - in a step that pulls otherwise at it than when it fell asleep (gravity, loads), fixes other
//     unknowns of it, or fixes and moves any;
//   - if anything moves by script, anywhere: obstacles have no islands.
// Off by default: implicit steps creep, and friction creeps by its law, slower than any speed that
// one would call rest. What creeps slower than `speed` stops, and no error estimate says so.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/report/error.hpp>
#include <taut/integrators/islands.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace taut {

namespace kernels {

template <class P, class S>
struct KineticSums {
  VectorField<typename P::position, S> v;
  Array<typename P::real, S> mass;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 2>& sums) const {
    auto const w = load3<double>(v, i);
    sums[0] += double(mass(i)) * dot(w, w);
    sums[1] += double(mass(i));
  }
};

/// What pulls at unknowns at rest at x: what the predictor asks for over h^2.
template <class P, class S>
struct PullAtRest {
  VectorField<typename P::position, S> x, predictor;
  FixedMask<S> fixed;
  double time_step;
  KOKKOS_FUNCTION Vec3<double> operator()(int i) const {
    if (fixed(i)) return {};
    return 1 / (time_step * time_step) * (load3<double>(predictor, i) - load3<double>(x, i));
  }
};

/// Pull, and which unknowns are fixed, where a body falls asleep.
template <class P, class S>
struct NoteLoads {
  PullAtRest<P, S> now;
  FixedMask<S> fixed;
  VectorField<double, S> pull;
  typename Bodies<S>::Indices body;
  Kokkos::View<int*, typename S::memory> falls;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (!falls(body(i))) return;
    store3(pull, i, now(i));
    fixed(i) = now.fixed(i);
  }
};

/// How much the pull at what sleeps has changed since, against how much there is.
template <class P, class S>
struct CompareLoads {
  PullAtRest<P, S> now;
  FixedMask<S> fixed;
  VectorField<double, S> pull;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 2>& sums) const {
    Vec3<double> const a = now(i), change = a - load3<double>(pull, i);
    sums[0] +=
        fixed(i) == now.fixed(i) ? dot(change, change) : Kokkos::Experimental::infinity_v<double>;
    sums[1] += dot(a, a);
  }
};

/// Takes the predictor of what sleeps back.
template <class P, class S>
struct StayAsleep {
  VectorField<typename P::position, S> x, predictor;
  typename Bodies<S>::Indices body;
  Kokkos::View<int*, typename S::memory> asleep;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (!asleep(body(i))) return;
    for (int c = 0; c < 3; ++c) predictor(i, c) = x(i, c);
  }
};

/// Velocity and past of what falls asleep.
template <class P, class S>
struct StandStill {
  VectorField<typename P::position, S> x, v, x_last, v_last;
  typename Bodies<S>::Indices body;
  Kokkos::View<int*, typename S::memory> falls;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (!falls(body(i))) return;
    for (int c = 0; c < 3; ++c) {
      x_last(i, c) = x(i, c);
      v(i, c) = v_last(i, c) = 0;
    }
  }
};

/// Raises to the distance that what is fixed has to go.
template <class P, class S>
struct PrescribedMotion {
  FixedMask<S> fixed;
  VectorField<typename P::position, S> x, prescribed;
  KOKKOS_FUNCTION void operator()(int i, double& largest) const {
    if (!fixed(i)) return;
    for (int c = 0; c < 3; ++c) {
      largest = Kokkos::max(largest, Kokkos::abs(double(prescribed(i, c)) - double(x(i, c))));
    }
  }
};

/// Unknowns that have moved.
template <class P, class S>
struct CountMoved {
  VectorField<typename P::position, S> from, to;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 2>& sums) const {
    bool moved = false;
    for (int c = 0; c < 3; ++c) moved = moved || from(i, c) != to(i, c);
    if (moved) sums[0] += 1;
  }
};

}  // namespace kernels

template <class P, class S>
class Sleep {
public:
  using Positions = VectorField<typename P::position, S>;
  struct Params {
    bool on = false;
    double speed = 0;  ///< m/s, mass-weighted rms over a body; needed where it is on
    int steps = 20;    ///< in a row
  };

  Sleep() = default;
  /// Throws Error for a speed that is not positive, or no steps, where it is on.
  explicit Sleep(Params const& params) : params_(params) {
    if (!params.on) return;
    if (!(params.speed > 0) || !std::isfinite(params.speed) || params.steps < 1) {
      throw Error("sleep below {} m/s for {} steps: give a positive speed and 1 step or more",
                  params.speed, params.steps);
    }
  }

  /// What a run that goes on needs to know.
  struct Record {
    std::vector<int> quiet;  ///< slow steps in a row, per body
    std::vector<int> noted;  ///< per body: asleep, and pull and fixed are known
    std::vector<double> pull;
    std::vector<int> fixed;
  };

  /// Before a step from x, once terms know of it: wakes what has reason to, and lays the predictor
  /// of what has none back to x. `h` is the one whose square is the factor of energies.
  template <class Potential>
  void lie(Potential& potential, Positions const& x, Positions const& predictor, double h) {
    if (!params_.on) return;
    if constexpr (DivisibleObjective<Potential>) {
      lay(potential, x, predictor, h);
    } else {
      throw Error("sleep: this potential knows of no bodies: switch sleep off");
    }
  }

  /// After it: who has moved is awake, who was slow comes closer to sleep, and what falls asleep
  /// stands still. Its loads are noted now, under those of this step: they may change in the next.
  /// `predict()` gives the predictor of a step as this one from where all is now; it is asked only
  /// if something falls asleep.
  template <class Potential, class State, class Predict>
  void settle(Potential& potential, State const& state, double h, Predict const& predict) {
    if (!params_.on) return;
    if constexpr (DivisibleObjective<Potential>) look(potential, state, h, predict);
  }

  /// For checkpoints, between two steps.
  Record record() const {
    if (bodies_.of.extent(0) == 0) return record_;
    Record now{quiet_, {noted_.begin(), noted_.end()}, {}, {}};
    auto const pull = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), pull_);
    auto const fixed = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), fixed_);
    for (int i = 0; i < pull.extent_int(0); ++i) {
      for (int c = 0; c < 3; ++c) now.pull.push_back(pull(i, c));
      now.fixed.push_back(fixed(i));
    }
    return now;
  }
  /// Goes on from there, from the next step on.
  void restore(Record record) {
    record_ = std::move(record);
    bodies_ = {};
  }

private:
  template <class Potential>
  void lay(Potential& potential, Positions const& x, Positions const& predictor, double h) {
    prepare(potential);
    find_islands(potential, x);
    if (moves(potential, x)) std::fill(quiet_.begin(), quiet_.end(), 0);
    auto const sums = sums_.template sum<2>(
        "sleep_loads",
        kernels::CompareLoads<P, S>{{x, predictor, potential.fixed(), h}, fixed_, pull_});
    for (int b = 0; b < bodies_.count; ++b) {
      constexpr double same = 1e-20;  // squared; an unchanged pull is the same to the last bit
      if (noted_[b] && sums[2 * b] > same * sums[2 * b + 1]) quiet_[b] = 0;
      // Quiet for long, but in an island that was not: its loads are to be noted first.
      if (!noted_[b]) quiet_[b] = std::min(quiet_[b], params_.steps - 1);
    }
    std::vector<char> asleep(bodies_.count);
    std::vector<char> const resting = resting_islands();
    for (int b = 0; b < bodies_.count; ++b) {
      asleep[b] = noted_[b] = resting[label_[b]];
      // Woken by another, it need not be quiet again for as long.
      if (!asleep[b]) quiet_[b] = std::min(quiet_[b], params_.steps - 1);
    }
    send([&](int b) { return asleep[b]; });
    for_each<S>("stay_asleep", x.extent_int(0),
                kernels::StayAsleep<P, S>{x, predictor, bodies_.of, flag_});
    potential.set_asleep(std::move(asleep));
  }

  template <class Potential, class State, class Predict>
  void look(Potential& potential, State const& state, double h, Predict const& predict) {
    auto const of_moved =
        sums_.template sum<2>("sleep_moved", kernels::CountMoved<P, S>{state.x_last, state.x});
    std::vector<double> const moved(of_moved.begin(), of_moved.end());
    auto const energy =
        sums_.template sum<2>("sleep_speed", kernels::KineticSums<P, S>{state.v, potential.mass()});
    for (int b = 0; b < bodies_.count; ++b) {
      bool const slept = potential.asleep()[b] && moved[2 * b] == 0;
      bool const woken = potential.asleep()[b] && !slept;
      bool const slow = energy[2 * b] <= params_.speed * params_.speed * energy[2 * b + 1];
      if (slept) continue;
      noted_[b] = 0;
      quiet_[b] = slow && !woken ? std::min(quiet_[b] + 1, params_.steps) : 0;
    }
    std::vector<char> const resting = resting_islands();
    bool any = false;
    auto const falls = [&](int b) { return resting[label_[b]] && !noted_[b]; };
    for (int b = 0; b < bodies_.count; ++b) any = any || falls(b);
    if (any) {
      send(falls);
      for_each<S>("fall_asleep", state.x.extent_int(0),
                  kernels::StandStill<P, S>{state.x, state.v, state.x_last, state.v_last,
                                            bodies_.of, flag_});
      for_each<S>(
          "note_loads", state.x.extent_int(0),
          kernels::NoteLoads<P, S>{
              {state.x, predict(), potential.fixed(), h}, fixed_, pull_, bodies_.of, flag_});
      for (int b = 0; b < bodies_.count; ++b) {
        if (falls(b)) noted_[b] = 1;
      }
    }
    potential.set_asleep({});
  }

  template <class Potential>
  void prepare(Potential& potential) {
    if (bodies_.of.extent_int(0) == potential.size()) return;
    if (!potential.divisible()) {
      throw Error(
          "sleep: a term of the potential knows of no bodies (DivisibleTerm): switch sleep off");
    }
    bodies_ = potential.bodies();
    sums_ = BodySums<S, double>(bodies_, 2);
    pull_ = VectorField<double, S>("sleep_pull", potential.size());
    fixed_ = FixedMask<S>("sleep_fixed", potential.size());
    flag_ = Kokkos::View<int*, typename S::memory>("sleep_flag", bodies_.count);
    host_flag_ = Kokkos::create_mirror_view(flag_);
    take_up(potential.size());
  }
  /// What has been restored, or that all is awake.
  void take_up(int unknowns) {
    Record const from = std::exchange(record_, {});
    bool const known = static_cast<int>(from.quiet.size()) == bodies_.count &&
                       static_cast<int>(from.noted.size()) == bodies_.count &&
                       static_cast<int>(from.fixed.size()) == unknowns &&
                       from.pull.size() == 3 * from.fixed.size();
    if (!from.quiet.empty() && !known) {
      throw Error("sleep: what is to go on is of {} bodies and {} unknowns, not of {} and {}",
                  from.quiet.size(), from.fixed.size(), bodies_.count, unknowns);
    }
    noted_.assign(bodies_.count, 0);
    quiet_.assign(bodies_.count, 0);
    if (!known) return;
    quiet_ = from.quiet;
    noted_.assign(from.noted.begin(), from.noted.end());
    auto const pull = Kokkos::create_mirror_view(pull_);
    auto const fixed = Kokkos::create_mirror_view(fixed_);
    for (int i = 0; i < unknowns; ++i) {
      for (int c = 0; c < 3; ++c) pull(i, c) = from.pull[3 * i + c];
      fixed(i) = static_cast<std::uint8_t>(from.fixed[i]);
    }
    assign(pull_, pull);
    assign(fixed_, fixed);
  }
  template <class Potential>
  void find_islands(Potential& potential, Positions const& x) {
    potential.pattern_version(x);
    for (int b = 0; b < bodies_.count; ++b) host_flag_(b) = b;
    assign_on<S>(flag_, host_flag_);
    potential.link(flag_);
    assign_on<S>(host_flag_, flag_);
    S::instance().fence("taut: islands");
    label_.assign(host_flag_.data(), host_flag_.data() + bodies_.count);
  }
  template <class Potential>
  bool moves(Potential& potential, Positions const& x) const {
    kernels::PrescribedMotion<P, S> const motion{potential.fixed(), x,
                                                 potential.unknowns().prescribed};
    return maximum<S>("sleep_prescribed", x.extent_int(0), potential.motion_left(x), motion) > 0;
  }
  /// By label: whether all bodies of the island have been quiet for long enough.
  std::vector<char> resting_islands() const {
    std::vector<char> resting(bodies_.count, 1);
    for (int b = 0; b < bodies_.count; ++b) {
      if (quiet_[b] < params_.steps) resting[label_[b]] = 0;
    }
    return resting;
  }
  template <class Flag>
  void send(Flag const& of) {
    for (int b = 0; b < bodies_.count; ++b) host_flag_(b) = of(b) ? 1 : 0;
    assign_on<S>(flag_, host_flag_);
    S::instance().fence("taut: sleep");
  }

  Params params_;
  Bodies<S> bodies_;
  BodySums<S, double> sums_;
  VectorField<double, S> pull_;  ///< m/s^2, when it fell asleep
  FixedMask<S> fixed_;           ///< then
  Kokkos::View<int*, typename S::memory> flag_;
  typename Kokkos::View<int*, typename S::memory>::HostMirror host_flag_;
  std::vector<int> label_;   ///< island of each body where the step began
  std::vector<int> quiet_;   ///< slow steps in a row
  std::vector<char> noted_;  ///< asleep: its pull is known
  Record record_;            ///< to go on from, until the next step begins
};

}  // namespace taut
