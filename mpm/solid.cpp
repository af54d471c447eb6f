#include <taut/core/report/error.hpp>
#include <taut/mpm/solid.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace taut {
namespace {

void check_size(char const* what, double size) {
  if (!(size > 0) || !std::isfinite(size)) {
    throw Error("{} of {} m: give one above 0", what, size);
  }
}

}  // namespace

Solid solid_box(Vec3<double> const& lengths) {
  for (int c = 0; c < 3; ++c) check_size("a box with an edge", lengths[c]);
  Vec3<double> const half = 0.5 * lengths;
  return {[half](Vec3<double> const& x) {
            return std::abs(x[0]) <= half[0] && std::abs(x[1]) <= half[1] &&
                   std::abs(x[2]) <= half[2];
          },
          -half, half, lengths[0] * lengths[1] * lengths[2]};
}

Solid solid_ball(double radius) {
  check_size("a ball with a radius", radius);
  return {[radius](Vec3<double> const& x) { return dot(x, x) <= radius * radius; },
          {-radius, -radius, -radius},
          {radius, radius, radius},
          4.0 / 3 * std::numbers::pi * radius * radius * radius};
}

Solid solid_cylinder(double radius, double height) {
  check_size("a cylinder with a radius", radius);
  check_size("a cylinder with a height", height);
  double const half = height / 2;
  return {[=](Vec3<double> const& x) {
            return x[0] * x[0] + x[2] * x[2] <= radius * radius && std::abs(x[1]) <= half;
          },
          {-radius, -half, -radius},
          {radius, half, radius},
          std::numbers::pi * radius * radius * height};
}

Solid solid_torus(double ring, double section) {
  check_size("a torus with a ring", ring);
  check_size("a torus with a section", section);
  if (!(section < ring)) {
    throw Error(
        "a torus with a section of {} m around a ring of {} m: give a section below the ring",
        section, ring);
  }
  double const r = ring + section;
  return {[=](Vec3<double> const& x) {
            double const d = std::hypot(x[0], x[2]) - ring;
            return d * d + x[1] * x[1] <= section * section;
          },
          {-r, -section, -r},
          {r, section, r},
          2 * std::numbers::pi * std::numbers::pi * ring * section * section};
}

Solid placed(Solid const& solid, RigidPose const& pose) {
  if (!(distortion(pose.rotation) < 1e-6) || !std::isfinite(norm(pose.translation))) {
    throw Error(
        "a body is placed where it cannot be: its rotation is none, or its place is not "
        "finite");
  }
  Solid result;
  result.volume = solid.volume;
  result.holds = [inner = solid.holds, pose](Vec3<double> const& x) {
    return inner(transpose_times(pose.rotation, x - pose.translation));
  };
  double const inf = std::numeric_limits<double>::infinity();
  result.lowest = {inf, inf, inf};
  result.highest = {-inf, -inf, -inf};
  for (int corner = 0; corner < 8; ++corner) {
    Vec3<double> x;
    for (int c = 0; c < 3; ++c) x[c] = corner >> c & 1 ? solid.highest[c] : solid.lowest[c];
    x = pose(x);
    for (int c = 0; c < 3; ++c) {
      result.lowest[c] = std::min(result.lowest[c], x[c]);
      result.highest[c] = std::max(result.highest[c], x[c]);
    }
  }
  return result;
}

Solid without(Solid const& solid, Solid const& hole) {
  constexpr int n = 128;
  std::int64_t all = 0, left = 0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k) {
        int const at[3] = {i, j, k};
        Vec3<double> x;
        for (int c = 0; c < 3; ++c) {
          x[c] = solid.lowest[c] + (at[c] + 0.5) / n * (solid.highest[c] - solid.lowest[c]);
        }
        if (!solid.holds(x)) continue;
        ++all;
        left += !hole.holds(x);
      }
  if (all == 0) {
    throw Error(
        "a body so thin that none of {}^3 points in the box around it is in it cannot have a hole: "
        "make "
        "it thicker, or leave the hole out",
        n);
  }
  if (left == 0) throw Error("a body of which nothing is left: the hole covers it");
  return {[inside = solid.holds, out = hole.holds](Vec3<double> const& x) {
            return inside(x) && !out(x);
          },
          solid.lowest, solid.highest,
          solid.volume * static_cast<double>(left) / static_cast<double>(all)};
}

}  // namespace taut
