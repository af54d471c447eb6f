// Where an obstacle is and where it is going: a script says where it is to be at the end of a step,
// and it goes there in portions. From one pose to the other its centre goes straight, at an even
// speed, while it turns evenly about the centre by the shortest turn (rigid_pose.hpp). After each
// portion the way is found anew from where the obstacle is stored.
#pragma once

#include <taut/contact/gap_path.hpp>
#include <taut/core/math/rigid_pose.hpp>
#include <taut/core/report/error.hpp>

namespace taut {

/// Where an obstacle goes during a step of length 1.
struct FaceMotion {
  Vec3<double> along{0, 0, 0};  ///< of the centre, m
  Turn turn;
  /// By how much the centre, m, and directions may be off where they are stored after a part of the
  /// step or all of it.
  double origin_error = 0, direction_error = 0;
  bool moves = false;
};

class ObstacleTrack {
public:
  /// `centre`: of the shape in its own frame, m.
  explicit ObstacleTrack(Vec3<double> const& centre = {0, 0, 0}) : centre_(centre) {}

  RigidPose const& pose() const { return pose_; }
  RigidPose const& target() const { return target_; }
  /// From `pose` to `target`.
  FaceMotion const& motion() const { return motion_; }

  /// Throws Error if that is no pose.
  void move_to(RigidPose const& target) {
    check(target);
    target_ = target;
    find_motion();
  }
  void place(RigidPose const& pose) {
    check(pose);
    pose_ = pose;
    move_to(pose);
  }
  /// By a share of the motion; from 1 on it lands exactly.
  void advance(double fraction) {
    if (!motion_.moves || !(fraction > 0)) return;
    if (fraction >= 1) return place(RigidPose(target_));
    Vec3<double> const from = pose_(centre_);
    if (motion_.turn.angle != 0) {
      pose_.rotation =
          turn_matrix({motion_.turn.axis, fraction * motion_.turn.angle}) * pose_.rotation;
    }
    pose_.translation = from + fraction * motion_.along - pose_.rotation * centre_;
    find_motion();
  }

private:
  static void check(RigidPose const& pose) {
    double const off = distortion(pose.rotation);
    if (!(off < 1e-10)) {
      throw Error(
          "obstacle: a pose whose matrix R is no rotation (R'R is {} off the identity, or R "
          "mirrors): give one that keeps lengths",
          off);
    }
    for (int c = 0; c < 3; ++c) {
      if (!std::isfinite(pose.translation[c])) {
        throw Error("obstacle: a pose at ({}, {}, {}): give finite coordinates",
                    pose.translation[0], pose.translation[1], pose.translation[2]);
      }
    }
  }

  void find_motion() {
    motion_ = {};
    bool turned = false;
    for (int k = 0; k < 9; ++k) turned |= pose_.rotation.a[k] != target_.rotation.a[k];
    for (int c = 0; c < 3; ++c) {
      motion_.moves |= turned || pose_.translation[c] != target_.translation[c];
    }
    if (!motion_.moves) return;
    constexpr double budget = kernels::budget<double>;
    Vec3<double> const from = pose_(centre_), to = target_(centre_);
    motion_.along = to - from;
    // 8 u of each number that a centre is computed from, at either end.
    motion_.origin_error = 2 * budget * (2 * norm(centre_) + norm(from) + norm(to));
    if (!turned) return;
    motion_.turn = turn_of(target_.rotation * transpose(pose_.rotation));
    Mat3<double> const off = turn_matrix(motion_.turn) * pose_.rotation - target_.rotation;
    motion_.direction_error = 4 * budget + std::sqrt(contract(off, off));
  }

  Vec3<double> centre_;
  RigidPose pose_, target_;
  FaceMotion motion_;
};

}  // namespace taut
