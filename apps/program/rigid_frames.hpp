// The scene's points and rigid maps as the vectors and poses of the library.
#pragma once

#include <taut/apps/program/scene_motion.hpp>
#include <taut/core/math/rigid_pose.hpp>

namespace taut {

inline Vec3<double> to_vec(Point const& p) { return {p[0], p[1], p[2]}; }
inline Point to_point(Vec3<double> const& x) { return {x[0], x[1], x[2]}; }
inline RigidPose to_pose(RigidMap const& map) {
  RigidPose pose;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) pose.rotation(r, c) = map.rotation[r][c];
  pose.translation = to_vec(map.translation);
  return pose;
}

}  // namespace taut
