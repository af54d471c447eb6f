// Points inside a triangle surface. Triangles are listed by the columns of a grid that they cover,
// seen along each axis, so that a ray meets few.
#include <taut/core/report/error.hpp>
#include <taut/mpm/solid.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace taut {
namespace {

/// The surface seen along one axis.
class Columns {
public:
  Columns(TriangleMesh const& surface, int axis, Point const& lowest, Point const& highest)
      : u_((axis + 1) % 3), v_((axis + 2) % 3), w_(axis) {
    n_ = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(surface.triangles.size()))), 1,
                    1024);
    for (int k = 0; k < 2; ++k) {
      int const c = k == 0 ? u_ : v_;
      from_[k] = lowest[c];
      per_length_[k] = highest[c] > lowest[c] ? n_ / (highest[c] - lowest[c]) : 0;
    }
    lists_.resize(std::size_t(n_) * n_);
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      int range[2][2];
      for (int k = 0; k < 2; ++k) {
        double low = 1e300, high = -1e300;
        for (int const corner : surface.triangles[t]) {
          double const x = surface.points[corner][k == 0 ? u_ : v_];
          low = std::min(low, x);
          high = std::max(high, x);
        }
        range[k][0] = column(k, low);
        range[k][1] = column(k, high);
      }
      for (int i = range[0][0]; i <= range[0][1]; ++i)
        for (int j = range[1][0]; j <= range[1][1]; ++j) {
          lists_[std::size_t(i) * n_ + j].push_back(static_cast<int>(t));
        }
    }
  }

  /// How often the surface winds around q; nothing where the ray through q leaves it more often
  /// than it enters, so that there is no telling.
  std::optional<int> winding(TriangleMesh const& surface, Vec3<double> const& q) const {
    int above = 0, all = 0;
    for (int const t : lists_[std::size_t(column(0, q[u_])) * n_ + column(1, q[v_])]) {
      auto const& corner = surface.triangles[t];
      double area[3];
      int side[3];
      for (int k = 0; k < 3; ++k) {
        side[k] = side_of(surface, corner[(k + 1) % 3], corner[(k + 2) % 3], q, area[k]);
      }
      if (side[0] != side[1] || side[1] != side[2]) continue;
      double const sum = area[0] + area[1] + area[2];
      double height = surface.points[corner[0]][w_];
      if (sum != 0) {
        height = 0;
        for (int k = 0; k < 3; ++k) height += area[k] / sum * surface.points[corner[k]][w_];
      }
      all += side[0];
      if (height > q[w_]) above += side[0];
    }
    if (all != 0) return std::nullopt;
    return above;
  }

private:
  int column(int k, double x) const {
    return std::clamp(static_cast<int>((x - from_[k]) * per_length_[k]), 0, n_ - 1);
  }
  /// On which side of the edge from a to b the ray through q passes, and twice the area of q, a, b.
  /// The same for both triangles of an edge, but for the sign.
  int side_of(TriangleMesh const& surface, int a, int b, Vec3<double> const& q,
              double& area) const {
    int const sign = a < b ? 1 : -1;
    Point const& low = surface.points[std::min(a, b)];
    Point const& high = surface.points[std::max(a, b)];
    double const d =
        (low[u_] - q[u_]) * (high[v_] - q[v_]) - (low[v_] - q[v_]) * (high[u_] - q[u_]);
    area = sign * d;
    if (d != 0) return d < 0 ? -sign : sign;
    // As if q were moved by (e, e^2), e smaller than any number (Edelsbrunner and Muecke 1990).
    double const moved = low[v_] != high[v_] ? low[v_] - high[v_] : high[u_] - low[u_];
    return moved == 0 ? 0 : moved < 0 ? -sign : sign;
  }

  int u_, v_, w_, n_ = 1;
  double from_[2], per_length_[2];
  std::vector<std::vector<int>> lists_;
};

/// Sides of triangles that are walked more often one way than the other.
std::size_t open_edges(std::vector<Triangle> const& triangles) {
  std::vector<std::pair<Edge, int>> edges;
  edges.reserve(3 * triangles.size());
  for (Triangle const& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      int const a = t[k], b = t[(k + 1) % 3];
      edges.push_back({{std::min(a, b), std::max(a, b)}, a < b ? 1 : -1});
    }
  std::sort(edges.begin(), edges.end());
  std::size_t open = 0;
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t last = first;
    int sum = 0;
    for (; last < edges.size() && edges[last].first == edges[first].first; ++last) {
      sum += edges[last].second;
    }
    open += sum != 0;
    first = last;
  }
  return open;
}

}  // namespace

Solid solid_in_surface(TriangleMesh const& surface, std::string const& name, double open) {
  if (surface.triangles.empty()) throw Error("surface \"{}\" has no triangles", name);
  double const inf = std::numeric_limits<double>::infinity();
  Point lowest{inf, inf, inf}, highest{-inf, -inf, -inf};
  for (Triangle const& t : surface.triangles)
    for (int const v : t) {
      if (v < 0 || std::size_t(v) >= surface.points.size()) {
        throw Error("surface \"{}\" names vertex {} of {}", name, v, surface.points.size());
      }
      for (std::size_t c = 0; c < 3; ++c) {
        if (!std::isfinite(surface.points[v][c])) {
          throw Error("surface \"{}\": vertex {} is not finite", name, v);
        }
        lowest[c] = std::min(lowest[c], surface.points[v][c]);
        highest[c] = std::max(highest[c], surface.points[v][c]);
      }
    }
  std::size_t const holes = open_edges(surface.triangles);
  if (static_cast<double>(holes) > open * 1.5 * static_cast<double>(surface.triangles.size())) {
    throw Error("surface \"{}\" is open: {} of its edges are at holes; close it, or allow them",
                name, holes);
  }
  // Around the middle, so that what a small hole leaves out is small.
  Vec3<double> const middle{0.5 * (lowest[0] + highest[0]), 0.5 * (lowest[1] + highest[1]),
                            0.5 * (lowest[2] + highest[2])};
  double volume = 0;
  for (Triangle const& t : surface.triangles) {
    Vec3<double> e[3];
    for (std::size_t k = 0; k < 3; ++k)
      for (int c = 0; c < 3; ++c)
        e[k][c] = surface.points[t[k]][static_cast<std::size_t>(c)] - middle[c];
    volume += dot(e[0], cross(e[1], e[2])) / 6;
  }
  double box = 1;
  for (std::size_t c = 0; c < 3; ++c) box *= highest[c] - lowest[c];
  if (!(std::abs(volume) > 1e-9 * box)) {
    throw Error("surface \"{}\" has no inside: it encloses {} m^3", name, volume);
  }
  struct Seen {
    TriangleMesh surface;
    std::array<Columns, 3> along;
  };
  auto const seen = std::make_shared<Seen const>(
      Seen{surface,
           {Columns(surface, 0, lowest, highest), Columns(surface, 1, lowest, highest),
            Columns(surface, 2, lowest, highest)}});
  Solid solid;
  solid.lowest = {lowest[0], lowest[1], lowest[2]};
  solid.highest = {highest[0], highest[1], highest[2]};
  solid.volume = std::abs(volume);
  solid.holds = [seen, low = solid.lowest, high = solid.highest](Vec3<double> const& x) {
    for (int c = 0; c < 3; ++c) {
      if (!(x[c] >= low[c] && x[c] <= high[c])) return false;
    }
    for (std::size_t axis : {2, 0, 1}) {
      if (auto const winding = seen->along[axis].winding(seen->surface, x)) return *winding != 0;
    }
    return false;
  };
  return solid;
}

}  // namespace taut
