#include <taut/core/report/error.hpp>
#include <taut/mpm/distance_field.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace taut {
namespace {

Vec3<double> to_vec(Point const& p) { return {p[0], p[1], p[2]}; }

/// |x - (a + t (b - a))|^2 for the best t in [0, 1].
double to_segment(Vec3<double> const& x, Vec3<double> const& a, Vec3<double> const& b) {
  Vec3<double> const e = b - a, r = x - a;
  double const length = dot(e, e);
  double const t = length > 0 ? std::clamp(dot(r, e) / length, 0.0, 1.0) : 0;
  Vec3<double> const d = r - t * e;
  return dot(d, d);
}

/// The square of the distance from x to a triangle: to its plane if the foot is inside, else to the
/// nearest of its edges.
double to_triangle(Vec3<double> const& x, Vec3<double> const (&v)[3]) {
  Vec3<double> const normal = cross(v[1] - v[0], v[2] - v[0]);
  double const square = dot(normal, normal);
  bool inside = square > 0;
  double nearest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    Vec3<double> const &a = v[k], &b = v[(k + 1) % 3];
    inside = inside && dot(cross(b - a, x - a), normal) >= 0;
    nearest = std::min(nearest, to_segment(x, a, b));
  }
  if (!inside) return nearest;
  double const height = dot(x - v[0], normal);
  return std::min(nearest, height * height / square);
}

}  // namespace

DistanceField distance_field(TriangleMesh const& surface, Solid const& solid, double spacing,
                             double band, std::string const& name) {
  if (!(spacing > 0) || !(band > spacing) || !std::isfinite(band)) {
    throw Error("{}: distances in cells of {} m up to {} m: give a band above the cells", name,
                spacing, band);
  }
  DistanceField field;
  field.spacing = spacing;
  field.band = band;
  double count = 1;
  for (int c = 0; c < 3; ++c) {
    // A point more on each side than the band reaches: outside.
    field.lowest[c] = solid.lowest[c] - band - spacing;
    double const points = std::ceil((solid.highest[c] + band - field.lowest[c]) / spacing) + 2;
    count *= points;
    if (!(count < double(1 << 28))) {
      throw Error("{}: distances in cells of {:.3g} m would be too many: raise grid.spacing", name,
                  spacing);
    }
    field.n[static_cast<std::size_t>(c)] = static_cast<int>(points);
  }
  field.values.assign(static_cast<std::size_t>(count), static_cast<float>(band));
  auto const& n = field.n;
  auto const number = [&](int i, int j, int k) {
    return (std::size_t(i) * std::size_t(n[1]) + std::size_t(j)) * std::size_t(n[2]) +
           std::size_t(k);
  };
  auto const place = [&](int i, int j, int k) {
    return field.lowest + spacing * Vec3<double>{double(i), double(j), double(k)};
  };
  for (Triangle const& triangle : surface.triangles) {
    Vec3<double> v[3];
    for (std::size_t k = 0; k < 3; ++k) {
      v[k] = to_vec(surface.points[static_cast<std::size_t>(triangle[k])]);
    }
    int first[3], last[3];
    for (int c = 0; c < 3; ++c) {
      double const low = std::min({v[0][c], v[1][c], v[2][c]}) - band,
                   high = std::max({v[0][c], v[1][c], v[2][c]}) + band;
      first[c] = std::max(0, static_cast<int>(std::ceil((low - field.lowest[c]) / spacing)));
      last[c] = std::min(n[static_cast<std::size_t>(c)] - 1,
                         static_cast<int>(std::floor((high - field.lowest[c]) / spacing)));
    }
    for (int i = first[0]; i <= last[0]; ++i)
      for (int j = first[1]; j <= last[1]; ++j)
        for (int k = first[2]; k <= last[2]; ++k) {
          float& value = field.values[number(i, j, k)];
          value = std::min(value, static_cast<float>(std::sqrt(to_triangle(place(i, j, k), v))));
        }
  }
  // What is farther than the band is on the side of what is before it: a line begins outside.
  for (int i = 0; i < n[0]; ++i)
    for (int j = 0; j < n[1]; ++j) {
      bool inside = false;
      for (int k = 0; k < n[2]; ++k) {
        float& value = field.values[number(i, j, k)];
        if (value < static_cast<float>(band)) inside = solid.holds(place(i, j, k));
        if (inside) value = -value;
      }
    }
  return field;
}

}  // namespace taut
