#include <taut/core/report/error.hpp>
#include <taut/mpm/source.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace taut {
namespace {

/// Where a line is inside of a convex shape.
struct Span {
  double in = -std::numeric_limits<double>::infinity();
  double out = std::numeric_limits<double>::infinity();
  void cut(double low, double high) {
    in = std::max(in, low);
    out = std::min(out, high);
  }
  void cut_by_slab(double at, double along, double half) {
    if (along == 0) {
      if (std::abs(at) > half) cut(1, -1);
      return;
    }
    double const a = (-half - at) / along, b = (half - at) / along;
    cut(std::min(a, b), std::max(a, b));
  }
  /// a s^2 + 2 b s + c <= 0 with a >= 0.
  void cut_by_quadric(double a, double b, double c) {
    if (a == 0) {
      if (c > 0) cut(1, -1);
      return;
    }
    double const square = b * b - a * c;
    if (!(square > 0)) return cut(1, -1);
    double const root = std::sqrt(square);
    cut((-b - root) / a, (-b + root) / a);
  }
};

/// Of the line y + s e.
Span span_of(SourceSpec const& source, Vec3<double> const& y, Vec3<double> const& e) {
  Span span;
  if (source.shape == BoundaryShape::box) {
    for (int c = 0; c < 3; ++c) span.cut_by_slab(y[c], e[c], 0.5 * source.size[c]);
  } else if (source.shape == BoundaryShape::ball) {
    span.cut_by_quadric(1, dot(y, e), dot(y, y) - source.size[0] * source.size[0]);
  } else {
    double const r = source.size[0];
    // Round-off in the direction of a flow along the axis is no slope.
    double const across = e[0] * e[0] + e[2] * e[2];
    span.cut_by_quadric(across < 1e-24 ? 0 : across, y[0] * e[0] + y[2] * e[2],
                        y[0] * y[0] + y[2] * y[2] - r * r);
    span.cut_by_slab(y[1], e[1], 0.5 * source.size[1]);
  }
  return span;
}

/// Half the lengths of a box around the shape.
Vec3<double> half_box(SourceSpec const& source) {
  if (source.shape == BoundaryShape::box) return 0.5 * source.size;
  double const r = source.size[0];
  if (source.shape == BoundaryShape::ball) return {r, r, r};
  return {r, 0.5 * source.size[1], r};
}

void check(SourceSpec const& source, double dx) {
  constexpr int numbers[] = {0, 3, 1, 2, 0, 0};
  int const count = numbers[static_cast<int>(source.shape)];
  if (count == 0) {
    throw Error("source \"{}\": its shape is no box, ball or cylinder: take one of them",
                source.name);
  }
  for (int c = 0; c < count; ++c) {
    if (!(source.size[c] > 0) || !std::isfinite(source.size[c])) {
      throw Error("source \"{}\": a size of {} m; give one above 0", source.name, source.size[c]);
    }
  }
  double const speed = norm(source.velocity);
  if (!(speed > 0) || !std::isfinite(speed)) {
    throw Error("source \"{}\": its flow has {} m/s; give a velocity that is not 0", source.name,
                speed);
  }
  if (!(source.per_cell > 0) || !std::isfinite(source.per_cell) || !(dx > 0) ||
      !std::isfinite(dx)) {
    throw Error("source \"{}\": {} particles in a cell of {} m; give both above 0", source.name,
                source.per_cell, dx);
  }
  if (!(source.end > source.start) || !std::isfinite(source.start)) {
    throw Error("source \"{}\": it flows from {} s to {} s; let it end after its start",
                source.name, source.start, source.end);
  }
}

/// The line of a point of the cloud through the shape.
struct Line {
  double first;        ///< when a point of it leaves the shape, at or after the start, s
  Vec3<double> place;  ///< where, m
};

/// Those of all points of the cloud in one period along the flow. The cloud has `tile` metres and
/// its third axis along e.
std::vector<Line> lines(SourceSpec const& source, BlueNoise const& noise, double tile) {
  double const speed = norm(source.velocity);
  Vec3<double> const e = (1 / speed) * source.velocity;
  int thin = 0;
  for (int c = 1; c < 3; ++c) thin = std::abs(e[c]) < std::abs(e[thin]) ? c : thin;
  Vec3<double> axis{};
  axis[thin] = 1;
  Vec3<double> a = cross(axis, e);
  a = (1 / norm(a)) * a;
  Vec3<double> const b = cross(e, a), half = half_box(source);
  double reach[2] = {0, 0};
  for (int c = 0; c < 3; ++c) {
    reach[0] += std::abs(a[c]) * half[c];
    reach[1] += std::abs(b[c]) * half[c];
  }
  double const period = tile / speed;
  std::vector<Line> all;
  int const last[2] = {static_cast<int>(std::ceil(reach[0] / tile)),
                       static_cast<int>(std::ceil(reach[1] / tile))};
  for (int i = -last[0]; i < last[0]; ++i)
    for (int j = -last[1]; j < last[1]; ++j)
      for (Vec3<double> const& q : noise.points) {
        Vec3<double> const y = (tile * (i + q[0])) * a + (tile * (j + q[1])) * b;
        Span const span = span_of(source, y, e);
        if (!(span.in < span.out)) continue;
        // Its points are at s = tile (q + k) at the start, for all whole numbers k.
        double const wait = std::fmod((span.out - tile * q[2]) / speed, period);
        all.push_back({wait < 0 ? wait + period : wait, y + span.out * e});
      }
  std::sort(all.begin(), all.end(),
            [](Line const& one, Line const& other) { return one.first < other.first; });
  return all;
}

/// Calls visit(time, line) for what leaves the source up to `until`: period by period, each in the
/// order of time.
template <class Visit>
void for_each_leaving(SourceSpec const& source, std::vector<Line> const& all, double period,
                      double until, Visit const& visit) {
  for (std::int64_t k = 0; !all.empty(); ++k) {
    double const begun = source.start + static_cast<double>(k) * period;
    for (Line const& line : all) {
      double const time = begun + line.first;
      if (time > until || !(time < source.end)) return;
      visit(time, line);
    }
  }
}

}  // namespace

double shadow(SourceSpec const& source, Vec3<double> const& e) {
  double const r = source.size[0];
  if (source.shape == BoundaryShape::box) {
    return std::abs(e[0]) * source.size[1] * source.size[2] +
           std::abs(e[1]) * source.size[2] * source.size[0] +
           std::abs(e[2]) * source.size[0] * source.size[1];
  }
  if (source.shape == BoundaryShape::ball) return std::numbers::pi * r * r;
  return std::numbers::pi * r * r * std::abs(e[1]) +
         2 * r * source.size[1] * std::hypot(e[0], e[2]);
}

Outflow outflow(SourceSpec const& source, double dx, double until, std::uint64_t seed) {
  check(source, dx);
  constexpr int count = 8192;
  double const tile = dx * std::cbrt(count / source.per_cell), speed = norm(source.velocity);
  double const area = shadow(source, (1 / speed) * source.velocity), period = tile / speed;
  double const rate = area * speed / (dx * dx * dx) * source.per_cell;  // particles per second
  double const expected = rate * (std::min(until, source.end) - source.start);
  if (expected > 1e9) {
    throw Error(
        "source \"{}\" would let out {:.3g} particles: give a coarser grid than {} m, fewer per "
        "cell, or let it end sooner",
        source.name, expected, dx);
  }
  std::vector<Line> const all = lines(source, blue_noise(count, seed), tile);
  // One that would let out more than can be counted never ends.
  bool const ends = rate * (source.end - source.start) < 1e9;
  double const span = ends ? source.end - source.start : period;
  double in_span = 0;
  if (ends) {
    for_each_leaving(source, all, period, source.end, [&](double, Line const&) { ++in_span; });
  } else {
    in_span = static_cast<double>(all.size());
  }
  if (in_span == 0) {
    throw Error(
        "source \"{}\" has no room for a particle: a cell of {} m is too large for it, or it flows "
        "for too short a time",
        source.name, dx);
  }
  Outflow result;
  result.volume = area * speed * span / in_span;
  for_each_leaving(source, all, period, until, [&](double time, Line const& line) {
    result.points.push_back({time, line.place});
  });
  return result;
}

}  // namespace taut
