// Friction once more: serial, in fp64, over all pairs, with tangent bases and the formulas as the
// paper has them (Li et al. 2020, section 5.2 and the derivatives of its supplement).
#pragma once

#include "contact_scenes.hpp"

namespace taut::scenes {

struct FrictionOracle {
  double energy = 0, work = 0;
  int contacts = 0, sliding = 0;
  std::vector<Point> gradient;
  std::vector<double> curvature;  ///< 3n x 3n, by rows
  Vec3<double> moment{};          ///< Sum t x force over pairs, t the gap at the lag point

  /// Contacts at `lag`, slip from `from` to x, of pairs as in Oracle; `mu(a, b)` of objects.
  template <class Mu>
  FrictionOracle(Surface const& surface, std::vector<Point> const& rest,
                 std::vector<Point> const& lag, std::vector<Point> const& from,
                 std::vector<Point> const& x, double dhat, double cap, double pressure,
                 double length, Mu const& mu)
      : gradient(x.size()), curvature(9 * x.size() * x.size()), length_(length) {
    std::vector<double> const area = vertex_areas(surface, rest);
    soups::all_pairs(surface, [&](soups::Pair const& pair) {
      auto const& v = pair.v;
      int const a = surface.object[v[0]], b = surface.object[v[3]];
      double const activation = a == b ? std::min(dhat, cap * soups::distance(pair, rest)) : dhat;
      if (!(soups::distance(pair, lag) < activation) || mu(a, b) == 0) return;
      bool const edges = pair.kind == PairKind::edge_edge;
      double const patch =
          edges ? std::min((area[v[0]] + area[v[1]]) / 6, (area[v[2]] + area[v[3]]) / 6)
                : std::min(area[v[0]], (area[v[1]] + area[v[2]] + area[v[3]]) / 3);
      Vec3<double> y[4], r[4], w{};
      for (int k = 0; k < 4; ++k) y[k] = at(lag, v[k]), r[k] = at(rest, v[k]);
      PairParameters<double> const parameters{pressure * patch / 4 / dhat, activation,
                                              edges ? EdgeMollifier::scale(r) : 0};
      auto const s = PairEnergy<>::evaluate(pair.kind, parameters, y);
      double const force = -s.m.value * s.b1;
      if (!(force > 0)) return;
      for (int k = 0; k < 4; ++k) w = w + s.at.c[k] * (at(x, v[k]) - at(from, v[k]));
      add(pair, s, mu(a, b) * force, w);
    });
  }

private:
  static Vec3<double> at(std::vector<Point> const& x, int v) { return {x[v][0], x[v][1], x[v][2]}; }

  void add(soups::Pair const& pair, PairState<double> const& s, double limit,
           Vec3<double> const& w) {
    ++contacts;
    Vec3<double> const axis =
        std::abs(s.n[0]) < 0.7 ? Vec3<double>{1, 0, 0} : Vec3<double>{0, 1, 0};
    Vec3<double> const across = cross(s.n, axis);
    Vec3<double> const basis[2] = {(1 / norm(across)) * across,
                                   (1 / norm(across)) * cross(s.n, across)};
    double const u[2] = {dot(basis[0], w), dot(basis[1], w)}, e = length_;
    double const y = std::hypot(u[0], u[1]);
    bool const sticks = y < e;
    // f0 less its value at rest, e / 3.
    energy += limit * (sticks ? -y * y * y / (3 * e * e) + y * y / e : y - e / 3);
    double const f1 = sticks ? -y * y / (e * e) + 2 * y / e : 1;
    sliding += !sticks;
    work += limit * f1 * y;
    double force[2], h[2][2];
    for (int i = 0; i < 2; ++i) {
      force[i] = y > 0 ? limit * f1 * u[i] / y : 0;
      for (int j = 0; j < 2; ++j) h[i][j] = i == j ? limit * (y > 0 ? f1 / y : 2 / e) : 0;
    }
    Vec3<double> const f = force[0] * basis[0] + force[1] * basis[1];
    moment = moment + cross(s.at.t, f);
    std::size_t const n = gradient.size();
    for (int a = 0; a < 4; ++a)
      for (int i = 0; i < 3; ++i) {
        gradient[pair.v[a]][i] += s.at.c[a] * f[i];
        for (int b = 0; b < 4; ++b)
          for (int j = 0; j < 3; ++j) {
            double sum = 0;
            for (int k = 0; k < 2; ++k)
              for (int l = 0; l < 2; ++l) sum += basis[k][i] * h[k][l] * basis[l][j];
            curvature[3 * n * (3 * pair.v[a] + i) + 3 * pair.v[b] + j] +=
                s.at.c[a] * s.at.c[b] * sum;
          }
      }
  }

  double length_;
};

}  // namespace taut::scenes
