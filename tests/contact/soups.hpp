// Soups of triangles that are hard to search, and what there is to be found in them.
#pragma once

#include <taut/contact/broad_phase.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace taut::soups {

struct Soup {
  std::string name;
  Surface surface;
  std::vector<Point> x, p;  ///< m; p is how each vertex would move
  double radius = 0;        ///< m
  double edge_length = 0;   ///< m, what the search is told
};

using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline Point in_cube(Random& random, double half) {
  return {uniform(random, -half, half), uniform(random, -half, half), uniform(random, -half, half)};
}
inline double lengths_apart(Random& random, double low, double high) {
  return std::exp(uniform(random, std::log(low), std::log(high)));
}

enum class Kind {
  scattered,  ///< triangles of one size
  needles,    ///< a thousand times as long as wide
  lattice,    ///< corners on the corners of the cells
  rods,       ///< crossed rods, a radius apart, on both sides of a plane between cells
  far_away,   ///< large and negative coordinates
  one_cell,   ///< all within a fraction of a cell
  all_sizes,  ///< over seven decades
  one_point,  ///< all vertices in one place
  runaway,    ///< one vertex beyond all others
  strip,      ///< triangles that share vertices
  count
};

inline Soup make_soup(Kind kind, int seed, int triangles = 20) {
  Random random(1000 * static_cast<unsigned>(kind) + seed);
  Soup soup;
  soup.radius = 0.05;
  soup.edge_length = 0.25;
  std::vector<Triangle> corners;
  auto const add = [&](Point const& at, double size, double width) {
    Point const along = in_cube(random, size), across = in_cube(random, size * width);
    for (int k = 0; k < 3; ++k) {
      Point v = at;
      for (int c = 0; c < 3; ++c) v[c] += k == 1 ? along[c] : k == 2 ? across[c] : 0;
      soup.x.push_back(v);
    }
  };
  for (int i = 0; i < triangles; ++i) {
    switch (kind) {
      case Kind::scattered:
      case Kind::strip:
        soup.name = kind == Kind::strip ? "strip" : "scattered";
        add(in_cube(random, 0.5), 0.25, 1);
        break;
      case Kind::needles:
        soup.name = "needles";
        add(in_cube(random, 1), 10, 1e-3);
        break;
      case Kind::lattice:
        soup.name = "lattice";
        soup.radius = 0.5;
        soup.edge_length = 0.5;
        for (int k = 0; k < 3; ++k) {
          Point v;
          for (double& c : v) c = static_cast<double>(random() % 7) - 3;
          soup.x.push_back(v);
        }
        break;
      case Kind::rods: {
        soup.name = "rods";
        // Long along x just below z = 0, or along y a little less than the radius above.
        bool const above = i % 2 == 0;
        double const z = above ? 0.98 * soup.radius : 0, along = uniform(random, -1, 1);
        Point const from = above ? Point{along, -3, z} : Point{-3, along, z};
        soup.x.push_back(from);
        soup.x.push_back(above ? Point{along, 3, z} : Point{3, along, z});
        Point tip = from;
        tip[2] += above ? 2 : -2;
        soup.x.push_back(tip);
        break;
      }
      case Kind::far_away:
        soup.name = "far away";
        add(in_cube(random, 0.5), 0.25, 1);
        for (int k = 1; k <= 3; ++k) {
          Point& v = soup.x[soup.x.size() - k];
          v = {v[0] - 3e4, v[1] + 1e3, v[2] - 7e5};
        }
        break;
      case Kind::one_cell:
        soup.name = "one cell";
        soup.radius = 1e-3;
        soup.edge_length = 10;
        add(in_cube(random, 0.01), 0.01, 1);
        break;
      case Kind::all_sizes: {
        soup.name = "all sizes";
        double const size = lengths_apart(random, 1e-4, 1e3);
        add(in_cube(random, 2 * size), size, 1);
        break;
      }
      case Kind::one_point:
        soup.name = "one point";
        for (int k = 0; k < 3; ++k) soup.x.push_back({0.1, -0.2, 0.3});
        break;
      default:
        soup.name = "runaway";
        add(in_cube(random, 0.5), 0.25, 1);
        if (i == 0) soup.x[1] = {1e30, -1e25, 3};
    }
    int const first = 3 * i;
    corners.push_back({first, first + 1, first + 2});
    if (kind == Kind::strip && i > 0) {
      corners.push_back({first - 2, first - 1, first});
      corners.push_back({first - 1, first + 1, first});
    }
  }
  double const step = lengths_apart(random, 1e-3, 3);
  for (std::size_t v = 0; v < soup.x.size(); ++v) soup.p.push_back(in_cube(random, step));
  soup.surface = make_surface(corners, std::vector<int>(soup.x.size(), 0));
  return soup;
}

struct Pair {
  PairKind kind;
  std::array<int, 4> v;
};

struct HostCandidates {
  std::vector<std::array<int, 4>> point_triangle, edge_edge;
  bool operator==(HostCandidates const&) const = default;
};

/// The vertices of each pair.
template <PairKind kind, class S>
std::vector<std::array<int, 4>> to_host(CandidateList<kind, S> const& list) {
  auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), list.ids());
  std::vector<std::array<int, 4>> pairs(host.extent(0));
  for (std::size_t k = 0; k < pairs.size(); ++k)
    for (int a = 0; a < 4; ++a) pairs[k][a] = host(k, a);
  return pairs;
}
template <class S>
HostCandidates to_host(Candidates<S> const& found) {
  return {to_host(found.point_triangle), to_host(found.edge_edge)};
}

template <class T, class S>
VectorField<T, S> to_field(std::vector<Point> const& from) {
  VectorField<T, S> const field("field", from.size());
  auto const host = Kokkos::create_mirror_view(field);
  for (std::size_t v = 0; v < from.size(); ++v)
    for (int c = 0; c < 3; ++c) host(v, c) = static_cast<T>(from[v][c]);
  assign(field, host);
  return field;
}

/// Calls f(pair) for all pairs of a surface that share no vertex.
template <class F>
void all_pairs(Surface const& surface, F const& f) {
  for (std::int32_t const v : surface.vertices) {
    for (Triangle const& t : surface.triangles) {
      if (v == t[0] || v == t[1] || v == t[2]) continue;
      f(Pair{PairKind::point_triangle, {v, t[0], t[1], t[2]}});
    }
  }
  for (std::size_t i = 0; i < surface.edges.size(); ++i) {
    for (std::size_t j = i + 1; j < surface.edges.size(); ++j) {
      Edge const &a = surface.edges[i], &b = surface.edges[j];
      if (a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1]) continue;
      f(Pair{PairKind::edge_edge, {a[0], a[1], b[0], b[1]}});
    }
  }
}

/// Distance of a pair with its vertices at x, in fp64.
inline double distance(Pair const& pair, std::vector<Point> const& x) {
  Vec3<double> y[4];
  for (int a = 0; a < 4; ++a) y[a] = {x[pair.v[a]][0], x[pair.v[a]][1], x[pair.v[a]][2]};
  return closest_points(pair.kind, y).distance;
}

/// Which pairs there are in a list.
class PairSet {
public:
  explicit PairSet(HostCandidates const& found)
      : point_triangle_(found.point_triangle.begin(), found.point_triangle.end()),
        edge_edge_(found.edge_edge.begin(), found.edge_edge.end()) {}
  bool has(Pair const& pair) const {
    return (pair.kind == PairKind::edge_edge ? edge_edge_ : point_triangle_).contains(pair.v);
  }
  std::size_t size() const { return point_triangle_.size() + edge_edge_.size(); }
  /// How many of them the other has not.
  std::size_t missing_from(PairSet const& other) const {
    auto const lost = [](auto const& these, auto const& those) {
      return std::count_if(these.begin(), these.end(),
                           [&](auto const& pair) { return !those.contains(pair); });
    };
    return std::size_t(lost(point_triangle_, other.point_triangle_) +
                       lost(edge_edge_, other.edge_edge_));
  }

private:
  std::set<std::array<int, 4>> point_triangle_, edge_edge_;
};

/// The positions as stored in T, in fp64.
template <class T>
std::vector<Point> stored(std::vector<Point> from) {
  for (Point& v : from)
    for (double& c : v) c = static_cast<double>(static_cast<T>(c));
  return from;
}

}  // namespace taut::soups
