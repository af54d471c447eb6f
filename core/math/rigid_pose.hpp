// Where a rigid body is, and the shortest turn between two ways that it can face.
//
// A turn by the angle phi about the unit vector k is the matrix (Rodrigues)
//
//   exp(phi K) = I + sin(phi) K + 2 sin^2(phi / 2) K^2,   K y = k x y,
//
// and the turn of a matrix is found through its quaternion, from the largest of whose components
// the others follow (Shepperd 1978, "Quaternion from rotation matrix"): accurate at all angles, pi
// too.
#pragma once

#include <taut/core/math/matrix.hpp>

#include <cmath>

namespace taut {

/// x -> rotation x + translation
struct RigidPose {
  Mat3<double> rotation = identity3<double>();
  Vec3<double> translation{0, 0, 0};  ///< m

  Vec3<double> operator()(Vec3<double> const& x) const { return rotation * x + translation; }
};

/// The largest entry of R^T R - I: how far a matrix is from turning alone, 2 or more where it
/// mirrors. Not a number where an entry is none.
inline double distortion(Mat3<double> const& r) {
  Mat3<double> const product = transpose_times(r, r);
  double worst = determinant(r) > 0 ? 0 : 2;
  for (int k = 0; k < 9; ++k) {
    double const off = std::abs(product.a[k] - (k % 4 == 0 ? 1 : 0));
    worst = off <= worst ? worst : off;  // not a number stays
  }
  return worst;
}

struct Turn {
  Vec3<double> axis{0, 0, 1};  ///< of length 1
  double angle = 0;            ///< radians, right-handed
};

inline Mat3<double> turn_matrix(Turn const& turn) {
  Vec3<double> const& k = turn.axis;
  Mat3<double> const cross_by{{0, k[2], -k[1], -k[2], 0, k[0], k[1], -k[0], 0}};
  double const half = std::sin(turn.angle / 2);
  return identity3<double>() + std::sin(turn.angle) * cross_by +
         (2 * half * half) * (cross_by * cross_by);
}

/// The turn, by an angle in [0, pi], that a rotation matrix is.
inline Turn turn_of(Mat3<double> const& r) {
  // Four times the squares of w, x, y and z.
  double const square[4] = {1 + r(0, 0) + r(1, 1) + r(2, 2), 1 + r(0, 0) - r(1, 1) - r(2, 2),
                            1 - r(0, 0) + r(1, 1) - r(2, 2), 1 - r(0, 0) - r(1, 1) + r(2, 2)};
  int largest = 0;
  for (int i = 1; i < 4; ++i) largest = square[i] > square[largest] ? i : largest;
  double q[4];
  if (largest == 0) {
    double const w[4] = {square[0], r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)};
    for (int i = 0; i < 4; ++i) q[i] = w[i];
  } else {
    int const i = largest - 1, j = (i + 1) % 3, k = (i + 2) % 3;
    q[0] = r(k, j) - r(j, k);
    q[1 + i] = square[largest];
    q[1 + j] = r(j, i) + r(i, j);
    q[1 + k] = r(k, i) + r(i, k);
  }
  double const sign = q[0] < 0 ? -1 : 1;
  Vec3<double> const v{sign * q[1], sign * q[2], sign * q[3]};
  double const length = norm(v);
  if (!(length > 0)) return {};
  return {(1 / length) * v, 2 * std::atan2(length, std::abs(q[0]))};
}

}  // namespace taut
