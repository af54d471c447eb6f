#include <taut/apps/program/scene_motion.hpp>

#include <algorithm>
#include <cmath>

namespace taut {

double norm(Point const& a) { return std::sqrt(dot(a, a)); }

RigidMap rotation_about(Point const& axis, double angle, Point const& centre) {
  // Rodrigues: R = cos I + (1 - cos) a a^T + sin [a]x
  double const c = std::cos(angle), s = std::sin(angle);
  RigidMap map;
  for (std::size_t i = 0; i < 3; ++i) {
    std::size_t const j = (i + 1) % 3, k = (i + 2) % 3;
    map.rotation[i][i] = c + (1 - c) * axis[i] * axis[i];
    map.rotation[i][j] = (1 - c) * axis[i] * axis[j] - s * axis[k];
    map.rotation[i][k] = (1 - c) * axis[i] * axis[k] + s * axis[j];
  }
  map.translation = centre - map(centre);
  return map;
}

RigidMap inverse(RigidMap const& map) {
  RigidMap back;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) back.rotation[i][j] = map.rotation[j][i];
  back.translation = -1.0 * back(map.translation);
  return back;
}

RigidMap compose(RigidMap const& second, RigidMap const& first) {
  RigidMap map;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      map.rotation[i][j] = second.rotation[i][0] * first.rotation[0][j] +
                           second.rotation[i][1] * first.rotation[1][j] +
                           second.rotation[i][2] * first.rotation[2][j];
  map.translation = second(first.translation);
  return map;
}

RigidMap RigidMotion::at(double t) const {
  RigidMap map;
  for (MotionPhase const& phase : phases) {
    double const tau = std::min(t, phase.window.end) - phase.window.start;
    if (tau <= 0) break;
    double const angle = phase.angular_velocity * tau + phase.angular_acceleration * tau * tau / 2;
    RigidMap step = rotation_about(phase.axis, angle, phase.centre);
    step.translation = step.translation + tau * phase.velocity;
    map = compose(step, map);
  }
  return map;
}

}  // namespace taut
