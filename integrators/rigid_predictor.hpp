// Where the minimisation of a step starts, for bodies that turn or vibrate. The predictor moves
// every vertex straight on, so that a body that turns by an angle w in a step grows by w^2 / 2, and
// what vibrates faster than the step goes as far as if nothing held it. Soft bodies do that; a
// stiff one ends the step near a rigid motion, far from there. Of each body on which nothing is
// fixed, with x the positions, y the predictor and M the masses,
//
//   z = the rigid motion of x that is closest to y in M,   start = z + keep (y - z),
//
// where `keep` in [0, 1] is what would have been best the last time: the step before went from x-
// to x, by the predictor y- = x- + h v-, so keep = <x - z-, y- - z->_M / |y- - z-|_M^2, which is 1
// where nothing holds. It follows from the state alone, and only the start depends on it, never
// what is minimised.
//
// Derived here. z is the Procrustes problem: about the centres of mass, R is the polar rotation of
// sum m y x' (Arun, Huang, Blostein 1987); y - z is then orthogonal in M to turning z.
#pragma once

#include <taut/core/math/polar.hpp>
#include <taut/core/potential/objective.hpp>
#include <taut/integrators/fields.hpp>

#include <algorithm>

namespace taut {
namespace kernels {

/// What is known of a body: first the centres, then the rotations.
struct RigidBody {
  bool free = false;
  Vec3<double> centre[4];     ///< of x, y, x- and y-
  Mat3<double> turn, turned;  ///< x to y, x- to y-
  double keep = 0;
};

template <class P, class S>
struct RigidFields {
  using Positions = VectorField<typename P::position, S>;
  using List = Kokkos::View<RigidBody*, typename S::memory>;
  Array<typename P::real, S> mass;
  FixedMask<S> fixed;
  Positions x, y, x_last, v_last;
  double last_step;
  typename Bodies<S>::Indices body;
  List bodies;

  /// x, y, x- or y-.
  KOKKOS_FUNCTION Vec3<double> place(int i, int which) const {
    if (which == 0) return load3<double>(x, i);
    if (which == 1) return load3<double>(y, i);
    Vec3<double> const last = load3<double>(x_last, i);
    return which == 2 ? last : last + last_step * load3<double>(v_last, i);
  }
  /// The same, less the centre of the body.
  KOKKOS_FUNCTION Vec3<double> offset(int i, int which) const {
    return place(i, which) - bodies(body(i)).centre[which];
  }
};

/// Mass, whether anything is fixed, and first moments of x, y, x- and y-.
template <class P, class S>
struct RigidMoments : RigidFields<P, S> {
  static constexpr int sums = 14;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, sums>& sum) const {
    double const m = double(this->mass(i));
    sum[0] += m;
    sum[1] += this->fixed(i) ? 1 : 0;
    for (int which = 0; which < 4; ++which) {
      Vec3<double> const at = this->place(i, which);
      for (int c = 0; c < 3; ++c) sum[2 + 3 * which + c] += m * at[c];
    }
  }
};

/// sum m y x' and sum m y- x-' about the centres.
template <class P, class S>
struct RigidTurns : RigidFields<P, S> {
  static constexpr int sums = 18;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, sums>& sum) const {
    double const m = double(this->mass(i));
    for (int when = 0; when < 2; ++when) {
      Vec3<double> const from = this->offset(i, 2 * when), to = this->offset(i, 2 * when + 1);
      for (int col = 0; col < 3; ++col)
        for (int row = 0; row < 3; ++row) sum[9 * when + 3 * col + row] += m * to[row] * from[col];
    }
  }
};

/// |x|^2, |y - z|^2, <x - z-, y- - z-> and |y- - z-|^2 about the centres, in M.
template <class P, class S>
struct RigidRemainders : RigidFields<P, S> {
  static constexpr int sums = 4;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, sums>& sum) const {
    double const m = double(this->mass(i));
    RigidBody const& b = this->bodies(this->body(i));
    Vec3<double> const from = this->offset(i, 0), rest = this->offset(i, 1) - b.turn * from;
    Vec3<double> const rigid = b.turned * this->offset(i, 2);
    Vec3<double> const last = this->offset(i, 3) - rigid;
    sum[0] += m * dot(from, from);
    sum[1] += m * dot(rest, rest);
    sum[2] += m * dot(from - rigid, last);
    sum[3] += m * dot(last, last);
  }
};

/// y = z + keep (y - z)
template <class P, class S>
struct KeepPart : RigidFields<P, S> {
  KOKKOS_FUNCTION void operator()(int i) const {
    RigidBody const& b = this->bodies(this->body(i));
    if (!b.free) return;
    Vec3<double> const rigid = b.turn * this->offset(i, 0);
    store3(this->y, i, b.centre[1] + rigid + b.keep * (this->offset(i, 1) - rigid));
  }
};

}  // namespace kernels

/// Owns its memory: a step allocates nothing after the first.
template <class P, class S>
class RigidPredictor {
public:
  using Positions = VectorField<typename P::position, S>;
  struct Params {
    bool on = true;
  };

  RigidPredictor() = default;
  explicit RigidPredictor(Params const& params) : params_(params) {}

  /// Takes the predictor y of a step from `state` to the start. Leaves it where it is off, and
  /// where the potential knows of no bodies.
  template <class Potential, class State>
  void start(Potential& potential, State const& state, Positions const& y) {
    if constexpr (DivisibleObjective<Potential>) {
      if (params_.on && potential.divisible()) start_bodies(potential, state, y);
    }
  }

private:
  template <class Potential, class State>
  void start_bodies(Potential& potential, State const& state, Positions const& y) {
    prepare(potential);
    int const count = bodies_.count;
    using Moments = kernels::RigidMoments<P, S>;
    using Turns = kernels::RigidTurns<P, S>;
    using Remainders = kernels::RigidRemainders<P, S>;
    kernels::RigidFields<P, S> const fields{
        potential.mass(), potential.fixed(), state.x,    y,    state.x_last,
        state.v_last,     state.last_step,   bodies_.of, list_};
    auto const moments = sums_.template sum<Moments::sums>("rigid_moments", Moments{fields});
    bool any = false;
    for (int b = 0; b < count; ++b) {
      double const* sum = moments.data() + Moments::sums * b;
      kernels::RigidBody body;
      body.free = b < bodies_.connected && sum[0] > 0 && sum[1] == 0;
      any = any || body.free;
      for (int f = 0; f < 4; ++f)
        for (int c = 0; c < 3; ++c) body.centre[f][c] = body.free ? sum[2 + 3 * f + c] / sum[0] : 0;
      host_(b) = body;
    }
    if (!any) return;
    assign_on<S>(list_, host_);

    auto const turns = sums_.template sum<Turns::sums>("rigid_turns", Turns{fields});
    for (int b = 0; b < count; ++b) {
      double const* sum = turns.data() + Turns::sums * b;
      Mat3<double> now, last;
      for (int k = 0; k < 9; ++k) {
        now.a[k] = sum[k];
        last.a[k] = sum[9 + k];
      }
      host_(b).turn = polar_rotation(now);
      host_(b).turned = polar_rotation(last);
    }
    assign_on<S>(list_, host_);

    auto const rests = sums_.template sum<Remainders::sums>("rigid_remainders", Remainders{fields});
    for (int b = 0; b < count; ++b) {
      double const* sum = rests.data() + Remainders::sums * b;
      constexpr double nothing = 1e-12;  // squared, of the size of the body
      host_(b).free = host_(b).free && sum[1] > nothing * sum[0];
      host_(b).keep = sum[3] > nothing * sum[0] ? std::clamp(sum[2] / sum[3], 0.0, 1.0) : 0;
    }
    assign_on<S>(list_, host_);
    for_each<S>("keep_part", y.extent_int(0), kernels::KeepPart<P, S>{fields});
  }

  template <class Potential>
  void prepare(Potential& potential) {
    Bodies<S> const& bodies = potential.bodies();
    if (bodies_.of.extent(0) > 0 && bodies_.of.data() == bodies.of.data()) return;
    bodies_ = bodies;
    sums_ = BodySums<S, double>(bodies_, kernels::RigidTurns<P, S>::sums);
    list_ = typename kernels::RigidFields<P, S>::List("rigid_bodies", bodies_.count);
    host_ = Kokkos::create_mirror_view(list_);
  }

  Params params_;
  Bodies<S> bodies_;
  BodySums<S, double> sums_;
  typename kernels::RigidFields<P, S>::List list_;
  typename kernels::RigidFields<P, S>::List::HostMirror host_;
};

}  // namespace taut
