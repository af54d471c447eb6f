// Turns and their matrices.
#include <taut/core/math/rigid_pose.hpp>

#include <catch2/catch_test_macros.hpp>

#include <cmath>
#include <random>

using namespace taut;

namespace {

constexpr double pi = 3.14159265358979323846;

double furthest(Mat3<double> const& a, Mat3<double> const& b) {
  double r = 0;
  for (int k = 0; k < 9; ++k) r = std::max(r, std::abs(a.a[k] - b.a[k]));
  return r;
}

}  // namespace

TEST_CASE("a turn is found in its matrix, at any angle", "[math]") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int trial = 0; trial < 20000; ++trial) {
    Vec3<double> k{any(random), any(random), any(random)};
    if (trial % 5 == 0) k[trial % 3] = 0;
    k = (1 / norm(k)) * k;
    double angle = pi * std::abs(any(random));
    if (trial % 4 == 0) angle = std::pow(10.0, 8 * any(random) - 8);
    if (trial % 4 == 1) angle = pi - std::pow(10.0, 8 * any(random) - 8);
    if (trial % 100 == 2) angle = pi;
    Mat3<double> const matrix = turn_matrix({k, angle});
    REQUIRE(distortion(matrix) < 4e-15);
    Turn const found = turn_of(matrix);
    REQUIRE(std::abs(found.angle - angle) < 4e-15);
    REQUIRE(std::abs(norm(found.axis) - 1) < 1e-15);
    REQUIRE(furthest(turn_matrix(found), matrix) < 4e-15);
  }
}

TEST_CASE("a turn is right-handed, and none is none", "[math]") {
  Vec3<double> const y = turn_matrix({{0, 0, 1}, pi / 2}) * Vec3<double>{1, 0, 0};
  CHECK(std::abs(y[0]) < 1e-15);
  CHECK(std::abs(y[1] - 1) < 1e-15);
  CHECK(turn_of(identity3<double>()).angle == 0);
  CHECK(furthest(turn_matrix({}), identity3<double>()) == 0);
  Mat3<double> mirror = identity3<double>();
  mirror(0, 0) = -1;
  CHECK(distortion(mirror) >= 2);
  Mat3<double> none = identity3<double>();
  none(1, 2) = std::nan("");
  CHECK_FALSE(distortion(none) < 1);
}
