// Pairs along steps that are hard on a step bound.
#pragma once

#include "step_bound_oracle.hpp"

#include <random>

namespace taut::test {

enum class Hardship {
  none,          ///< corners and displacements of size 1
  tiny_gap,      ///< down to the round-off of what stores it
  far_away,      ///< coordinates of 1e3 and gaps of 1e-4
  parallel,      ///< edges parallel, the point on the border of a region
  sliding,       ///< along each other, with a large common velocity
  turning,       ///< one body turns fast
  fly_by,        ///< displacements of 1e2 to 1e6
  needle,        ///< triangles and edges of aspect 1e-4, or degenerate to segments and points
  half_at_rest,  ///< corners and components that do not move
  on_a_grid,     ///< integers: ties everywhere
};
inline constexpr int hardships = 10;

/// The number that T holds for a. GCC 12 at -O3 drops some of the roundings where doubles in a row
/// are narrowed and widened again; it may not where the narrow number is volatile.
template <class T>
double stored(double a) {
  T volatile const narrow = T(a);
  return double(narrow);
}

class Samples {
public:
  explicit Samples(unsigned seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  int one_of(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
  Vec3<double> vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  Vec3<double> unit_vector() {
    for (;;) {
      Vec3<double> const v = vector(1);
      double const length = norm(v);
      if (length > 0.1 && length < 1) return (1 / length) * v;
    }
  }

  /// Numbers that `Position` and `Real` hold exactly.
  template <class Position, class Real>
  PairMotion motion(PairKind kind, Hardship hardship) {
    PairMotion m = wide(kind, hardship, sizeof(Position) == sizeof(float));
    for (int k = 0; k < 4; ++k)
      for (int c = 0; c < 3; ++c) {
        m.x[k][c] = stored<Position>(m.x[k][c]);
        m.p[k][c] = stored<Real>(m.p[k][c]);
      }
    return m;
  }

private:
  /// The first body above the second by about `gap` along z, in some region of closest features.
  PairMotion facing(PairKind kind, double gap) {
    PairMotion m{kind, {}, {}};
    if (kind == PairKind::point_triangle) {
      double a = uniform(0, 1), b = uniform(0, 1);
      m.x[1] = {0, 0, 0};
      m.x[2] = {uniform(0.3, 1), uniform(-0.3, 0.3), 0};
      m.x[3] = {uniform(-0.3, 0.7), uniform(0.3, 1), 0};
      if (a + b > 1) a = 1 - a, b = 1 - b;
      if (one_of(4) == 0) a = 0;
      if (one_of(4) == 0) b = 0;
      m.x[0] = a * m.x[2] + b * m.x[3];
    } else {
      double const angle = uniform(0.1, 3.0);
      Vec3<double> const e{1, 0, 0}, f{std::cos(angle), std::sin(angle), 0};
      double const s = one_of(4) == 0 ? 0 : uniform(0, 1), t = one_of(4) == 0 ? 1 : uniform(0, 1);
      m.x[0] = -s * e;
      m.x[1] = (1 - s) * e;
      m.x[2] = -t * f;
      m.x[3] = (1 - t) * f;
    }
    for (int k = 0; k < m.first(); ++k) m.x[k][2] += gap;
    for (int k = 0; k < 4; ++k) m.p[k] = vector(gap < 0.01 ? 3 * gap : 0.3);
    return m;
  }

  /// A random turn, so that no axis is special.
  void turn(PairMotion& m) {
    Vec3<double> const a = unit_vector();
    Vec3<double> b = unit_vector();
    b = b - dot(a, b) * a;
    b = (1 / norm(b)) * b;
    Mat3<double> r;
    r.set_column(0, a);
    r.set_column(1, b);
    r.set_column(2, cross(a, b));
    for (int k = 0; k < 4; ++k) {
      m.x[k] = r * m.x[k];
      m.p[k] = r * m.p[k];
    }
  }
  void move(PairMotion& m, Vec3<double> const& by) {
    for (auto& x : m.x) x = x + by;
  }

  PairMotion wide(PairKind kind, Hardship hardship, bool coarse) {
    double const spread = std::pow(10, -uniform(0, 3));
    PairMotion m = facing(kind, uniform(0.01, 0.5));
    switch (hardship) {
      case Hardship::none:
        for (int k = 0; k < 4; ++k) m.x[k] = vector(1), m.p[k] = vector(1);
        return m;
      case Hardship::tiny_gap:
        m = facing(kind, std::pow(10, -uniform(2, coarse ? 6.5 : 15)));
        if (one_of(2) == 0) turn(m);
        if (one_of(2) == 0) move(m, vector(1));
        return m;
      case Hardship::far_away:
        m = facing(kind, uniform(0.5e-4, 4e-4));
        if (one_of(2) == 0) turn(m);
        move(m, vector(1e3));
        return m;
      case Hardship::parallel:
        m = facing(kind, spread);
        if (kind == PairKind::edge_edge) {
          Vec3<double> const e = m.x[1] - m.x[0];
          m.x[3] = m.x[2] + uniform(-2, 2) * e;
          if (one_of(2) == 0) m.x[3] = m.x[3] + vector(std::pow(10, -uniform(3, 9)));
        } else {
          int const k = one_of(3);
          double const s = one_of(3) * 0.5;
          m.x[0] = (1 - s) * m.x[1 + k] + s * m.x[1 + (k + 1) % 3];
          m.x[0][2] = spread;
          m.x[0] = m.x[0] + vector(std::pow(10, -uniform(3, 9)));
        }
        turn(m);
        return m;
      case Hardship::sliding: {
        m = facing(kind, spread);
        Vec3<double> const common = vector(uniform(0, 100));
        Vec3<double> slide = vector(10);
        slide[2] = uniform(-1, 1) * spread;
        for (int k = 0; k < 4; ++k) {
          m.p[k] = common + vector(0.1 * spread);
          if (k < m.first()) m.p[k] = m.p[k] + slide;
        }
        turn(m);
        return m;
      }
      case Hardship::turning: {
        m = facing(kind, spread);
        Vec3<double> const w = vector(5), at = vector(0.5);
        for (int k = m.first(); k < 4; ++k) m.p[k] = cross(w, m.x[k] - at);
        turn(m);
        return m;
      }
      case Hardship::fly_by: {
        m = facing(kind, spread);
        turn(m);
        Vec3<double> const v = vector(std::pow(10, uniform(2, 6)));
        for (int k = 0; k < 4; ++k) m.p[k] = vector(1) + (k < m.first() ? v : Vec3<double>{});
        if (one_of(2) == 0) move(m, -1e-5 * v);
        return m;
      }
      case Hardship::needle: {
        m = facing(kind, spread);
        double const thin = one_of(3) == 0 ? 0 : std::pow(10, -uniform(2, 5));
        int const from = one_of(2) == 0 ? m.first() : 0;
        for (int k = from + 1; k < (from == 0 ? m.first() : 4); ++k) {
          m.x[k] = m.x[from] + thin * (m.x[k] - m.x[from]);
          if (one_of(3) == 0) break;
        }
        turn(m);
        return m;
      }
      case Hardship::half_at_rest:
        for (auto& p : m.p) {
          for (int c = 0; c < 3; ++c) p[c] *= one_of(2);
          if (one_of(2) == 0) p = {};
        }
        if (one_of(2) == 0) move(m, vector(1e3));
        return m;
      case Hardship::on_a_grid:
        for (int k = 0; k < 4; ++k)
          for (int c = 0; c < 3; ++c) {
            m.x[k][c] = one_of(4);
            m.p[k][c] = one_of(5) - 2;
          }
        return m;
    }
    return m;
  }

  std::mt19937 engine_;
};

}  // namespace taut::test
