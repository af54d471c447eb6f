// What step bounds are judged by: proofs in exact arithmetic that a pair keeps its distance, and
// the true time at which it does not.
#pragma once

#include <taut/contact/pair_path.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <vector>

namespace taut::test {

/// A number as a sum of doubles that do not overlap, smallest first, so that nothing is ever
/// rounded (Shewchuk 1997, "Adaptive precision floating-point arithmetic").
class Exact {
public:
  void add(double b) {
    int kept = 0;
    for (int k = 0; k < count_; ++k) {
      double const sum = b + part_[k], shadow = sum - part_[k];
      double const rest = (part_[k] - (sum - shadow)) + (b - shadow);
      b = sum;
      if (rest != 0) part_[kept++] = rest;
    }
    if (b != 0) part_[kept++] = b;
    count_ = kept;
    if (count_ == capacity) throw std::length_error("Exact: too many parts");
  }
  void add_product(double a, double b) {
    double const product = a * b;
    add(std::fma(a, b, -product));
    add(product);
  }
  void add_product(double factor, Exact const& other) {
    for (int k = 0; k < other.count_; ++k) add_product(factor, other.part_[k]);
  }
  /// Within 2^-62 of itself; the sign is right.
  long double value() const {
    long double sum = 0;
    for (int k = 0; k < count_; ++k) sum += part_[k];
    return sum;
  }

private:
  static constexpr int capacity = 64;
  double part_[capacity];
  int count_ = 0;
};

using Long = Vec3<long double>;

inline long double long_norm(Long const& a) { return std::sqrt(dot(a, a)); }

/// A pair along a step: numbers as they are stored, whatever they are stored in.
struct PairMotion {
  PairKind kind;
  Vec3<double> x[4], p[4];

  int first() const { return kind == PairKind::point_triangle ? 1 : 2; }
  /// Positions at a, relative to corner 0, which cancels the large part of the coordinates.
  std::array<Long, 4> at(long double a) const {
    std::array<Long, 4> z;
    for (int k = 0; k < 4; ++k)
      for (int c = 0; c < 3; ++c) {
        z[k][c] = ((long double)x[k][c] - x[0][c]) + a * ((long double)p[k][c] - p[0][c]);
      }
    return z;
  }
  double size() const {
    auto const z = at(0);
    long double r = 0;
    for (auto const& y : z) r = std::max(r, long_norm(y));
    return double(r);
  }
};

inline Long from_segment(Long const& b, Long const& e) {
  long double const ee = dot(e, e);
  long double const s = ee > 0 ? std::clamp(dot(b, e) / ee, 0.0L, 1.0L) : 0.0L;
  return b - s * e;
}

/// From the second body to the first where they are closest: the shortest over the interiors and
/// all boundaries.
inline Long closest_difference(PairMotion const& m, long double a) {
  auto const z = m.at(a);
  Long best = z[0] - z[3];
  auto const offer = [&](Long const& t) {
    if (dot(t, t) < dot(best, best)) best = t;
  };
  if (m.kind == PairKind::point_triangle) {
    for (int k = 0; k < 3; ++k) {
      offer(from_segment(z[0] - z[1 + k], z[1 + (k + 1) % 3] - z[1 + k]));
    }
    Long const n = cross(z[2] - z[1], z[3] - z[1]);
    long double const nn = dot(n, n);
    bool inside = nn > 0;
    for (int k = 0; k < 3 && inside; ++k) {
      Long const &v = z[1 + k], w = z[1 + (k + 1) % 3];
      inside = dot(cross(w - v, z[0] - v), n) >= 0;
    }
    if (inside) offer((dot(z[0] - z[1], n) / nn) * n);
  } else {
    Long const u = z[1] - z[0], v = z[3] - z[2], n = cross(u, v);
    for (int k = 0; k < 2; ++k) {
      offer(from_segment(z[k] - z[2], v));
      offer(-from_segment(z[2 + k] - z[0], u));
    }
    long double const nn = dot(n, n);
    if (nn > 0) {
      Long const w = z[2] - z[0];
      long double const s = dot(cross(w, v), n) / nn, t = dot(cross(w, u), n) / nn;
      if (s >= 0 && s <= 1 && t >= 0 && t <= 1) offer((dot(z[0] - z[2], n) / nn) * n);
    }
  }
  return best;
}

inline double true_distance(PairMotion const& m, long double a) {
  return double(long_norm(closest_difference(m, a)));
}

/// Directions that may separate the pair at a: the difference of the closest points, the same made
/// orthogonal to each edge, and the normal.
inline std::vector<Vec3<double>> likely_directions(PairMotion const& m, long double a) {
  auto const z = m.at(a);
  Long const t = closest_difference(m, a);
  std::vector<Vec3<double>> result;
  auto const offer = [&](Long const& n) {
    long double const length = long_norm(n);
    if (!(length > 0)) return;
    Vec3<double> rounded;
    for (int c = 0; c < 3; ++c) rounded[c] = double(n[c] / length);
    result.push_back(rounded);
    result.push_back(-rounded);
  };
  offer(t);
  std::vector<Long> edges;
  if (m.kind == PairKind::point_triangle) {
    edges = {z[2] - z[1], z[3] - z[2], z[1] - z[3]};
  } else {
    edges = {z[1] - z[0], z[3] - z[2]};
  }
  for (auto const& e : edges) {
    long double const ee = dot(e, e);
    if (ee > 0) offer(t - (dot(t, e) / ee) * e);
  }
  offer(cross(edges[0], edges[1]));
  return result;
}

/// The gap between the shadows on n at a, without rounding.
inline long double exact_gap(PairMotion const& m, Vec3<double> const& n, double a) {
  long double least = INFINITY;
  for (int i = 0; i < m.first(); ++i) {
    for (int j = m.first(); j < 4; ++j) {
      Exact gap;
      for (int c = 0; c < 3; ++c) {
        Exact difference;
        difference.add(m.x[i][c]);
        difference.add(-m.x[j][c]);
        if (a != 0) {
          difference.add_product(a, m.p[i][c]);
          difference.add_product(-a, m.p[j][c]);
        }
        gap.add_product(n[c], difference);
      }
      least = std::min(least, gap.value());
    }
  }
  return least;
}

inline long double rounded_gap(PairMotion const& m, Vec3<double> const& n, double a) {
  auto const z = m.at(a);
  long double least = INFINITY;
  for (int i = 0; i < m.first(); ++i)
    for (int j = m.first(); j < 4; ++j) {
      long double gap = 0;
      for (int c = 0; c < 3; ++c) gap += n[c] * (z[i][c] - z[j][c]);
      least = std::min(least, gap);
    }
  return least;
}

/// Proves that the pair stays `kept` or further apart (0 < kept) for all a in [from, to]: splits
/// the interval until in each part one direction separates the pair by that much at both ends,
/// hence in between, in exact arithmetic. False where there is no such proof.
inline bool proved_apart(PairMotion const& m, double kept, double from, double to, int depth = 60) {
  Vec3<double> best{0, 0, 0};
  long double best_gap = -INFINITY;
  for (double a : {to, from + (to - from) / 2, from}) {
    for (auto const& n : likely_directions(m, a)) {
      long double const gap = std::min(rounded_gap(m, n, from), rounded_gap(m, n, to));
      if (gap > best_gap) {
        best_gap = gap;
        best = n;
      }
    }
    if (from == to) break;
  }
  Long const n{best[0], best[1], best[2]};
  long double const enough = kept * long_norm(n);
  if (best_gap > 0 && exact_gap(m, best, from) >= enough && exact_gap(m, best, to) >= enough) {
    return true;
  }
  double const middle = from + (to - from) / 2;
  if (depth == 0 || !(middle > from && middle < to)) return false;
  if (true_distance(m, middle) < kept * (1 - 1e-9)) return false;
  return proved_apart(m, kept, from, middle, depth - 1) &&
         proved_apart(m, kept, middle, to, depth - 1);
}

/// The first time at which the distance has fallen to `kept`, or `at_most`: by marching on as far
/// as the fastest corners can have closed, to within 1e-6 of what is left.
inline double true_reach(PairMotion const& m, double kept, double at_most) {
  double speed = 0;
  for (int i = 0; i < m.first(); ++i)
    for (int j = m.first(); j < 4; ++j) speed = std::max(speed, norm(m.p[i] - m.p[j]));
  double const start = true_distance(m, 0) - kept;
  double a = 0;
  while (a < at_most) {
    double const room = true_distance(m, a) - kept;
    if (room < 1e-6 * start) return a;
    a += room / speed;
  }
  return at_most;
}

}  // namespace taut::test
