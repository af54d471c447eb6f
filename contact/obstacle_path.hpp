// How far a vertex may go towards the faces of an obstacle, which may be going somewhere itself.
//
// The vertex goes from x along a p, the centre of the obstacle from o along a u, while the obstacle
// turns by a theta about the axis k through its centre: w(a) = (x - o) + a (p - u). Then
//
//   F(a) = g(w(a)) + a t - c0 - a c1
//
// is a lower bound of the distance g to a face as it is stored after a step of a, where t is a
// lower bound of what the turn adds per unit of a and c0, c1 are the charges for storing. As g is
// concave and w affine, F is concave: on [0, A] it is nowhere below the chord from F(0) to F(A),
// nor below the chord through lower bounds of those two. So one evaluation proves a step, and a
// guess of its length that is a little too long costs no more than that little. (A plane's F is its
// own chord.) Between the ends of a step nothing has to be proved in the sense of a mesh, for the
// set is convex and has no other side; what is proved is every shorter step too, as line searches
// ask for it.
//
// The turn. Q = exp(a theta K). For the normal n of a plane and all a in [0, A]
//
//   |Q n - n| <= a theta |k x n|,   |Q n - n - a theta k x n| <= (a theta)^2 / 2 |k x n|,
//
// hence Q n . w(a) - n . w(a) is at least either of
//
//   -a theta |k x n| W                                                  W = |w(0)| + A |p - u|
//   a theta (k x n) . w(0) - a A (theta |(k x n) . (p - u)| + theta^2 / 2 |k x n| W).
//
// A cylinder of axis b loses at most a theta |k x b| W, a sphere nothing. Shorter A makes the
// second line sharper, so A shrinks until it fits the step.
//
// Round-off is charged as in gap_path.hpp: 16 u of all numbers that a distance is made of (at most
// 8 u is lost: 3 u in w, 5 u in what follows); v |x_c| + 4 v a |p_c| for storing the vertex, or
// (1 + 4 v) a |p_c| in a very short step, with v of the positions' scalar; along a plane's normal,
// or as a length for faces that are round. What storing the obstacle costs is found where it is
// moved (obstacle_motion.hpp). All is in fp64, whatever the kernels' scalar is: a vertex has few
// faces.
#pragma once

#include <taut/contact/obstacle_motion.hpp>
#include <taut/contact/obstacle_shapes.hpp>
#include <taut/contact/step_bound.hpp>

namespace taut {

/// One vertex and one face along a step.
class FacePath {
public:
  /// `x` as stored, m; `p` its displacement in a step of length 1, m.
  template <class Position, class Real>
  KOKKOS_INLINE_FUNCTION FacePath(Vec3<Position> const& x, Vec3<Real> const& p,
                                  Vec3<double> const& origin, ObstacleFace const& face,
                                  FaceMotion const& motion)
      : face_(face), motion_(motion), at_rest_(!motion.moves) {
    constexpr double unit = Kokkos::Experimental::epsilon_v<Position> / 2;
    Vec3<double> far, moved;
    for (int c = 0; c < 3; ++c) {
      double const pc = double(p[c]);
      w_[c] = double(x[c]) - origin[c];
      q_[c] = pc - motion.along[c];
      at_rest_ = at_rest_ && pc == 0;
      far[c] = pc == 0 ? 0 : unit * double(x[c]);  // else it stays exactly where it is
      moved[c] = pc;
    }
    size_of_w_ = extent(w_) + Kokkos::abs(face.size);
    size_of_q_ = extent(q_);
    length_of_w_ = norm(w_);
    length_of_q_ = norm(q_);
    landing_ = more_ * extent(far) + tiny_;
    drift_ = more_ * extent(moved);
    storage_ = 4 * unit;
    if (motion.moves) landing_ += more_ * (motion.origin_error + unturned_error());
  }

  KOKKOS_INLINE_FUNCTION bool at_rest() const { return at_rest_; }

  /// A lower bound of the distance now, m.
  KOKKOS_INLINE_FUNCTION double separation() const {
    return distance_to(face_, w_).distance - budget_ * size_of_w_;
  }

  /// The longest step up to `at_most` (infinite too, unless the obstacle turns) that certainly
  /// leaves the clearance.
  KOKKOS_INLINE_FUNCTION Reach<double> reach(Clearance const& clearance, double at_most) const {
    if (at_rest_) return {at_most, 0, Settled::at_rest};
    double const gap = separation(), usable = clearance.usable(gap), kept = gap - usable;
    if (!(usable > 0)) return {0, 0, Settled::uncertain};
    double const target = kept * more_;
    double alpha = 0;
    for (int attempt = 0; attempt < 2 && !(alpha > 0); ++attempt) {
      alpha = longest(charge(attempt == 1), target, at_most);
    }
    return kernels::settle(alpha, kept, at_most, Settled::direction);
  }

private:
  static constexpr double budget_ = kernels::budget<double>;
  static constexpr double more_ = 1 + budget_, less_ = 1 - budget_;
  static constexpr double tiny_ = 16 * Kokkos::Experimental::norm_min_v<double>;

  /// c0 and c1.
  struct Charge {
    double once, rate;
  };
  KOKKOS_INLINE_FUNCTION Charge charge(bool short_step) const {
    double const turned = motion_.moves ? more_ * motion_.direction_error * length_of_q_ : 0;
    if (!short_step) return {landing_, storage_ * drift_ + turned};
    // What moves an obstacle is stored with an error however short the step.
    double const once = motion_.moves ? more_ * (motion_.origin_error + unturned_error()) : 0;
    return {once + tiny_, (1 + storage_) * drift_ + turned};
  }
  KOKKOS_INLINE_FUNCTION double unturned_error() const {
    return motion_.direction_error * length_of_w_;
  }
  /// How much errors of the components of `a` may change the distance.
  KOKKOS_INLINE_FUNCTION double extent(Vec3<double> const& a) const {
    if (face_.kind != FaceKind::plane) return norm(a);
    Vec3<double> const& n = face_.direction;
    return Kokkos::abs(n[0] * a[0]) + Kokkos::abs(n[1] * a[1]) + Kokkos::abs(n[2] * a[2]);
  }

  /// t for steps up to `at_most`.
  KOKKOS_INLINE_FUNCTION double turning(double at_most) const {
    double const theta = motion_.turn.angle;
    if (theta == 0 || face_.kind == FaceKind::sphere) return 0;
    Vec3<double> const swept = cross(motion_.turn.axis, face_.direction);
    double const whole = length_of_w_ + at_most * length_of_q_;
    double const any = norm(swept) * whole, noise = budget_ * whole;
    double const least = -theta * (any + noise);
    if (face_.kind == FaceKind::cylinder) return least;
    double const second = at_most * (Kokkos::abs(dot(swept, q_)) + 0.5 * theta * any);
    return Kokkos::max(least, theta * (dot(swept, w_) - second - noise));
  }

  /// A lower bound of F(a).
  KOKKOS_INLINE_FUNCTION double low(double a, double turn, Charge const& c) const {
    double const size = size_of_w_ + a * (size_of_q_ + Kokkos::abs(turn));
    return distance_to(face_, w_ + a * q_).distance + a * turn - budget_ * size -
           more_ * (c.once + a * c.rate);
  }

  /// The longest a for which F >= target on [0, a]; 0 where there is none.
  KOKKOS_INLINE_FUNCTION double longest(Charge const& c, double target, double at_most) const {
    if (motion_.turn.angle == 0) return within(at_most, 0, c, target);
    double most = at_most, alpha = 0;
    for (int k = 0; k < 12; ++k) {
      alpha = Kokkos::max(alpha, within(most, turning(most), c, target));
      if (!(alpha < most / 4)) break;
      most /= 4;
    }
    return alpha;
  }
  KOKKOS_INLINE_FUNCTION double within(double at_most, double turn, Charge const& c,
                                       double target) const {
    double const now = low(0, turn, c);
    if (!(now >= target)) return 0;
    bool const bounded = at_most < Kokkos::Experimental::infinity_v<double>;
    if (bounded && low(at_most, turn, c) >= target) return at_most;
    bool const flat = face_.kind == FaceKind::plane;
    double a = at_most;
    if (flat) {
      double const noise = budget_ * (size_of_q_ + Kokkos::abs(turn));
      double const slope = dot(face_.direction, q_) + turn - more_ * c.rate - noise;
      if (slope >= 0) return at_most;
      a = Kokkos::min(a, (now - target) / -slope * less_);
    } else {
      a = Kokkos::min(a, meets(target));
      // A path along the axis meets nothing until the charges have used up the room.
      if (!(a < Kokkos::Experimental::infinity_v<double>)) {
        a = (now - target) / (more_ * (c.rate - turn) + budget_ * size_of_q_);
        if (!(a < Kokkos::Experimental::infinity_v<double>)) return at_most;
      }
    }
    double const then = low(a, turn, c);
    if (then >= target) return a;
    double const share = (now - target) / (now - then) * less_;
    double const chord = share > 0 ? a * share : 0;  // not a number is none
    if (flat) return chord;
    // Longer, as a rule: where the distance has come down to the target and what is charged there.
    double const longer = meets(target + distance_to(face_, w_ + a * q_).distance - then);
    return longer > chord && longer < a && low(longer, turn, c) >= target ? longer : chord;
  }

  /// Where a round face is `distance` away, as far as rounding lets one say: the far root of
  /// |w + a q|^2 = r^2, across the axis. Infinite where it never is, 0 where it is nearer already.
  KOKKOS_INLINE_FUNCTION double meets(double distance) const {
    Vec3<double> w = w_, q = q_;
    if (face_.kind == FaceKind::cylinder) {
      w = cross(face_.direction, w_);
      q = cross(face_.direction, q_);
    }
    double const r = face_.size - distance, length = norm(w);
    double const a = dot(q, q), b = dot(w, q), c = (r - length) * (r + length);
    if (!(c > 0)) return 0;
    if (a == 0) return Kokkos::Experimental::infinity_v<double>;
    double const root = Kokkos::sqrt(b * b + a * c);
    return b > 0 ? c / (b + root) : (root - b) / a;
  }

  ObstacleFace face_;
  FaceMotion motion_;
  Vec3<double> w_, q_;
  double size_of_w_, size_of_q_, length_of_w_, length_of_q_;
  double landing_, drift_, storage_;
  bool at_rest_;
};

}  // namespace taut
