// Rigid motion of prescribed vertices as a function of time, in closed form.
//
// A motion is a list of phases. In a phase that began at time s the image y of a point under all
// earlier phases moves to  y(t) = c + v tau + R(a, w tau + 1/2 alpha tau^2) (y - c),  tau = t - s:
// a rotation about an axis a through the centre c, which is carried along by the velocity v.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

#include <array>
#include <limits>
#include <vector>

namespace taut {

inline Point operator+(Point const& a, Point const& b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}
inline Point operator-(Point const& a, Point const& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
inline Point operator*(double s, Point const& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline double dot(Point const& a, Point const& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Point cross(Point const& a, Point const& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double norm(Point const& a);

/// An interval of time, s.
struct Window {
  double start = 0;
  double end = std::numeric_limits<double>::infinity();

  /// Whether a time step of length h that ends at time t belongs to the window. Judged by the
  /// middle of the step, so that round-off in t never shifts an event by one step.
  bool covers_step(double t, double h) const { return start <= t - h / 2 && t - h / 2 < end; }
};

/// x -> R x + translation; the rows of R.
struct RigidMap {
  std::array<Point, 3> rotation{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Point translation{};

  Point operator()(Point const& x) const {
    return Point{dot(rotation[0], x), dot(rotation[1], x), dot(rotation[2], x)} + translation;
  }
};

/// Rotation by `angle` (radians, right-handed) about the unit vector `axis` through `centre`.
RigidMap rotation_about(Point const& axis, double angle, Point const& centre);

/// Of R x + t: R^T x - R^T t.
RigidMap inverse(RigidMap const& map);

/// The map that applies `first`, then `second`.
RigidMap compose(RigidMap const& second, RigidMap const& first);

struct MotionPhase {
  Window window{};
  Point velocity{};                 ///< m/s
  Point axis{0, 1, 0};              ///< unit vector
  Point centre{};                   ///< m, where the axis passes at the start of the phase
  double angular_velocity = 0;      ///< rad/s at the start of the phase
  double angular_acceleration = 0;  ///< rad/s^2
};

struct RigidMotion {
  std::vector<MotionPhase> phases;  ///< in order of time, without overlap

  /// Where time t has brought space since time 0; the identity without phases.
  RigidMap at(double t) const;
};

}  // namespace taut
