// The elastic energy of particles in plain serial code, straight from the definitions: every
// particle with every node, kernels written as functions of the distance.
#pragma once

#include <taut/materials/elastic.hpp>
#include <taut/mpm/particle_memory.hpp>
#include <taut/mpm/particles.hpp>
#include <taut/mpm/spline.hpp>

#include <array>
#include <cmath>
#include <vector>

namespace taut::test {

inline double spline_value(int width, double x) {
  double const r = std::abs(x);
  if (width == 2) return r < 1 ? 1 - r : 0;
  if (width == 3) {
    if (r < 0.5) return 0.75 - r * r;
    return r < 1.5 ? 0.5 * (1.5 - r) * (1.5 - r) : 0;
  }
  if (r < 1) return 0.5 * r * r * r - r * r + 2.0 / 3;
  return r < 2 ? (2 - r) * (2 - r) * (2 - r) / 6 : 0;
}
inline double spline_slope(int width, double x) {
  double const r = std::abs(x), sign = x < 0 ? -1 : 1;
  if (width == 2) return r < 1 ? -sign : 0;
  if (width == 3) {
    if (r < 0.5) return -2 * x;
    return r < 1.5 ? -sign * (1.5 - r) : 0;
  }
  if (r < 1) return sign * (1.5 * r * r - 2 * r);
  return r < 2 ? -sign * 0.5 * (2 - r) * (2 - r) : 0;
}

template <class Material>
struct ParticleOracle {
  using Field = std::vector<Vec3<double>>;
  int width;
  double dx;
  std::vector<Particle> particles;
  using Parameters = typename Material::template Parameters<double>;
  std::vector<Parameters> materials;
  std::vector<std::array<int, 3>> nodes;

  double weight(Particle const& p, int i) const {
    double w = 1;
    for (int c = 0; c < 3; ++c) w *= spline_value(width, p.x[c] / dx - nodes[i][c]);
    return w;
  }
  /// Of the weight as a function of the particle's place.
  Vec3<double> slope(Particle const& p, int i) const {
    Vec3<double> g{1 / dx, 1 / dx, 1 / dx};
    for (int axis = 0; axis < 3; ++axis)
      for (int c = 0; c < 3; ++c) {
        double const at = p.x[c] / dx - nodes[i][c];
        g[axis] *= c == axis ? spline_slope(width, at) : spline_value(width, at);
      }
    return g;
  }
  Mat3<double> change_of_F(Particle const& p, Field const& u) const {
    Mat3<double> G = 0.0 * identity3<double>();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      Vec3<double> const g = slope(p, static_cast<int>(i));
      if (dot(g, g) != 0) G = G + outer(u[i], g);
    }
    return G * p.F;
  }
  /// Places less where the nodes are at rest.
  Field displacements(Field const& x) const {
    Field u(x);
    for (std::size_t i = 0; i < nodes.size(); ++i)
      for (int c = 0; c < 3; ++c) u[i][c] -= dx * nodes[i][c];
    return u;
  }
  double volume(Particle const& p) const { return p.volume * p.stiffness; }
  /// With what the particle remembers, where the material takes that; what lags as it is at `lag`.
  Field lag;
  Parameters own(Particle const& p) const {
    Parameters const& m = materials[p.material];
    if constexpr (RememberingMaterial<Material>) {
      Mat3<double> const F = lag.empty() ? p.F : p.F + change_of_F(p, displacements(lag));
      return Material::with(m, Material::remember(m, F, p.plastic));
    }
    return m;
  }
  auto state(Particle const& p, Field const& u) const {
    return Material::evaluate(own(p), p.F + change_of_F(p, u));
  }
  double value(Field const& x) const {
    Field const u = displacements(x);
    double sum = 0;
    for (Particle const& p : particles) {
      sum += volume(p) * Material::energy(own(p), p.F + change_of_F(p, u));
    }
    return sum;
  }
  /// Calls visit(particle, state, node, b_i).
  template <class Visit>
  void for_each_pair(Field const& x, Visit const& visit) const {
    Field const u = displacements(x);
    for (Particle const& p : particles) {
      auto const s = state(p, u);
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        Vec3<double> const g = slope(p, static_cast<int>(i));
        if (dot(g, g) != 0) visit(p, s, i, transpose_times(p.F, g));
      }
    }
  }
  Field gradient(Field const& x) const {
    Field f(nodes.size(), Vec3<double>{});
    for_each_pair(x, [&](Particle const& p, auto const& s, std::size_t i, Vec3<double> const& b) {
      f[i] = f[i] + volume(p) * (Material::stress(s) * b);
    });
    return f;
  }
  std::vector<Sym3<double>> blocks(Field const& x) const {
    std::vector<Sym3<double>> h(nodes.size(), Sym3<double>{});
    for_each_pair(x, [&](Particle const& p, auto const& s, std::size_t i, Vec3<double> const& b) {
      Sym3<double> const one = Material::block(s, b);
      for (int k = 0; k < 6; ++k) h[i].s[k] += volume(p) * one.s[k];
    });
    return h;
  }
  Field diagonal(Field const& x) const {
    Field h(nodes.size(), Vec3<double>{});
    for_each_pair(x, [&](Particle const& p, auto const& s, std::size_t i, Vec3<double> const& b) {
      h[i] = h[i] + volume(p) * Material::diagonal(s, b);
    });
    return h;
  }
  double quadratic_form(Field const& x, Field const& p) const {
    Field const u = displacements(x);
    double sum = 0;
    for (Particle const& q : particles) {
      sum += volume(q) * Material::quadratic(state(q, u), change_of_F(q, p));
    }
    return sum;
  }
  Field product(Field const& x, Field const& p) const {
    Field const u = displacements(x);
    Field y(nodes.size(), Vec3<double>{});
    for (Particle const& q : particles) {
      Mat3<double> const dP = Material::frame(state(q, u)).apply(change_of_F(q, p));
      for (std::size_t i = 0; i < nodes.size(); ++i) {
        y[i] = y[i] + volume(q) * (dP * transpose_times(q.F, slope(q, static_cast<int>(i))));
      }
    }
    return y;
  }
};

}  // namespace taut::test
