// Scenes for the contact term, and the term once more: serial, in fp64, over all pairs.
#pragma once

#include "soups.hpp"

#include <taut/contact/contact.hpp>
#include <taut/core/fem/body.hpp>
#include <taut/core/fem/shapes.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace taut::scenes {

/// Boxes as one mesh, moved by `place(body, point)`.
struct Boxes {
  TetMesh mesh;
  std::vector<int> object;

  template <class Place>
  Boxes(std::vector<std::pair<BoxShape, int>> const& boxes, Place const& place) {
    for (std::size_t b = 0; b < boxes.size(); ++b) {
      TetMesh const box = make_shape(boxes[b].first, boxes[b].second);
      int const first = static_cast<int>(mesh.points.size());
      for (Point const& x : box.points) {
        mesh.points.push_back(place(static_cast<int>(b), x));
        object.push_back(static_cast<int>(b));
      }
      for (Tet t : box.tets) {
        for (std::int32_t& v : t) v += first;
        mesh.tets.push_back(t);
      }
    }
  }
  Surface surface() const { return make_surface(boundary_faces(mesh.tets), object); }
};

inline Point turned(Point const& x, double angle) {
  double const c = std::cos(angle), s = std::sin(angle);
  return {c * x[0] + s * x[2], x[1], c * x[2] - s * x[0]};
}

/// A cube on a cube, turned, uneven, so close that points, edges and faces act; the upper one is
/// so squashed that it touches itself.
struct Squashed {
  static constexpr double dhat = 0.15;
  std::vector<Point> rest, x, p;
  Surface surface;

  explicit Squashed(unsigned seed = 7) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uneven(-0.02, 0.02), any(-1, 1);
    Boxes const boxes({{BoxShape{}, 2}, {BoxShape{{0.8, 0.8, 0.8}}, 2}}, [&](int b, Point x0) {
      for (double& c : x0) c += uneven(random);
      if (b == 0) return x0;
      Point const t = turned(x0, 0.3);
      return Point{t[0], t[1] + 0.97, t[2]};
    });
    rest = x = boxes.mesh.points;
    for (std::size_t v = 0; v < x.size(); ++v) {
      if (boxes.object[v] == 1) x[v][1] = 0.57 + 0.4 * (x[v][1] - 0.57);
      p.push_back({any(random), any(random), any(random)});
    }
    surface = boxes.surface();
  }
  int size() const { return static_cast<int>(x.size()); }
};

/// Energy, gradient and Gauss-Newton matrix (3n x 3n, by rows).
struct Oracle {
  double energy = 0, smallest_gap = 1;
  int contacts = 0;
  std::vector<int> acting;  ///< per vertex: 1 if it is of a contact
  std::vector<Point> gradient;
  std::vector<double> hessian;

  /// K = P min(areas) / (4 dhat), areas as thirds of triangles.
  Oracle(Surface const& surface, std::vector<Point> const& rest, std::vector<Point> const& x,
         double dhat, double cap, double pressure)
      : acting(x.size()), gradient(x.size()), hessian(9 * x.size() * x.size()) {
    std::vector<double> area(x.size());
    for (Triangle const& t : surface.triangles) {
      double const whole =
          0.5 * norm(cross(at(rest, t[1]) - at(rest, t[0]), at(rest, t[2]) - at(rest, t[0])));
      for (int v : t) area[v] += whole / 3;
    }
    soups::all_pairs(surface, [&](soups::Pair const& pair) {
      auto const& v = pair.v;
      bool const one_body = surface.object[v[0]] == surface.object[v[3]];
      double const a = one_body ? std::min(dhat, cap * soups::distance(pair, rest)) : dhat;
      double const d = soups::distance(pair, x);
      if (a > 0) smallest_gap = std::min(smallest_gap, d / a);
      if (!(d < a)) return;
      ++contacts;
      for (int k : v) acting[k] = 1;
      bool const edges = pair.kind == PairKind::edge_edge;
      double const patch =
          edges ? std::min((area[v[0]] + area[v[1]]) / 6, (area[v[2]] + area[v[3]]) / 6)
                : std::min(area[v[0]], (area[v[1]] + area[v[2]] + area[v[3]]) / 3);
      Vec3<double> y[4], r[4];
      for (int k = 0; k < 4; ++k) y[k] = at(x, v[k]), r[k] = at(rest, v[k]);
      PairParameters<double> const parameters{pressure * patch / 4 / dhat, a,
                                              edges ? EdgeMollifier::scale(r) : 0};
      add(pair, PairEnergy<>::evaluate(pair.kind, parameters, y));
    });
  }
  double form(std::vector<Point> const& p) const {
    std::size_t const n = 3 * p.size();
    double sum = 0;
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < n; ++j) {
        sum += p[i / 3][i % 3] * hessian[n * i + j] * p[j / 3][j % 3];
      }
    return sum;
  }

private:
  static Vec3<double> at(std::vector<Point> const& x, int v) { return {x[v][0], x[v][1], x[v][2]}; }
  void add(soups::Pair const& pair, PairState<double> const& s) {
    energy += PairEnergy<>::value(s);
    auto const h = PairEnergy<>::hessian(s);
    std::size_t const n = gradient.size();
    for (int a = 0; a < 4; ++a) {
      Vec3<double> const g = PairEnergy<>::gradient(s, a);
      for (int c = 0; c < 3; ++c) {
        gradient[pair.v[a]][c] += g[c];
        for (int j = 0; j < 12; ++j) {
          hessian[3 * n * (3 * pair.v[a] + c) + 3 * pair.v[j / 3] + j % 3] += h(3 * a + c, j);
        }
      }
    }
  }
};

/// Edges that run through triangles, by the signs of volumes; none of two that share a vertex.
inline int intersections(Surface const& surface, std::vector<Point> const& x) {
  auto const volume = [&](int a, int b, int c, int d) {
    long double e[3][3];
    int const v[3] = {b, c, d};
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) e[i][k] = static_cast<long double>(x[v[i]][k]) - x[a][k];
    return e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
           e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
           e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
  };
  int count = 0;
  for (Edge const& e : surface.edges) {
    for (Triangle const& t : surface.triangles) {
      bool const shared = e[0] == t[0] || e[0] == t[1] || e[0] == t[2] || e[1] == t[0] ||
                          e[1] == t[1] || e[1] == t[2];
      long double const from = volume(t[0], t[1], t[2], e[0]), to = volume(t[0], t[1], t[2], e[1]);
      long double side = 0;
      for (int k = 0; k < 3; ++k)
        side = std::max(side, std::abs((long double)x[t[1]][k] - x[t[0]][k]));
      // Within a flat face (of a body in free flight) signs are those of round-off.
      bool const flat = std::max(std::abs(from), std::abs(to)) < 1e-12L * side * side * side;
      if (shared || flat || (from > 0) == (to > 0)) continue;
      bool const first = volume(e[0], e[1], t[0], t[1]) > 0;
      count += first == (volume(e[0], e[1], t[1], t[2]) > 0) &&
               first == (volume(e[0], e[1], t[2], t[0]) > 0);
    }
  }
  return count;
}

/// The largest error of `numbers` of curvature per vertex (the diagonal, or that and the upper
/// entries of the diagonal block) against `scale` times the diagonal blocks of a Hessian (3n x 3n,
/// by rows), over their largest entry.
template <class Curvature>
double curvature_error(Curvature const& field, int numbers, std::vector<double> const& hessian,
                       double scale) {
  auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
  int const row[6] = {0, 1, 2, 0, 1, 0}, column[6] = {0, 1, 2, 1, 2, 2};
  std::size_t const n = host.extent(0);
  double stiffest = 0, error = 0;
  for (std::size_t v = 0; v < n; ++v)
    for (int k = 0; k < 6; ++k) {
      double const h = scale * hessian[3 * n * (3 * v + row[k]) + 3 * v + column[k]];
      stiffest = std::max(stiffest, std::abs(h));
      if (k < numbers) error = std::max(error, std::abs(double(host(v, k)) - h));
    }
  return error / stiffest;
}

template <class Field>
std::vector<Point> to_points(Field const& field) {
  auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
  std::vector<Point> points(host.extent(0));
  for (std::size_t v = 0; v < points.size(); ++v)
    for (int c = 0; c < 3; ++c) points[v][c] = static_cast<double>(host(v, c));
  return points;
}

}  // namespace taut::scenes
