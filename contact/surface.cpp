#include <taut/contact/surface.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace taut {

namespace {

/// A side of a triangle: its edge, and whether the triangle runs from its lower to its upper
/// vertex.
struct Side {
  Edge edge;
  bool forward;
};

/// All sides, those of one edge together.
std::vector<Side> sorted_sides(std::vector<Triangle> const& triangles) {
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  for (Triangle const& t : triangles) {
    for (std::size_t a = 0; a < 3; ++a) {
      std::int32_t const from = t[a], to = t[(a + 1) % 3];
      sides.push_back({{std::min(from, to), std::max(from, to)}, from < to});
    }
  }
  std::sort(sides.begin(), sides.end(),
            [](Side const& a, Side const& b) { return a.edge < b.edge; });
  return sides;
}

void check_triangle(Triangle const& t, std::size_t index, std::vector<int> const& object) {
  for (std::int32_t const v : t) {
    if (v < 0 || v >= std::ssize(object)) {
      throw Error("surface: triangle {} names vertex {}, but there are {}: export the mesh again",
                  index, v, object.size());
    }
    if (object[v] != object[t[0]]) {
      throw Error(
          "surface: triangle {} has vertices of the bodies {} and {}: give both the same number or "
          "take the triangle out",
          index, object[t[0]], object[v]);
    }
  }
  if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) {
    throw Error("surface: triangle {} ({}, {}, {}) names a vertex twice: take it out", index, t[0],
                t[1], t[2]);
  }
}

/// "3 edges (0-4, 2-7, 2-9)", with the first few by name.
std::string named(std::vector<Edge> const& edges) {
  std::string names;
  for (std::size_t i = 0; i < std::min<std::size_t>(edges.size(), 6); ++i) {
    names += fmt::format("{}{}-{}", i > 0 ? ", " : "", edges[i][0], edges[i][1]);
  }
  return fmt::format("{} {} ({}{})", edges.size(), edges.size() == 1 ? "edge" : "edges", names,
                     edges.size() > 6 ? ", ..." : "");
}

std::vector<std::size_t> repeated_triangles(std::vector<Triangle> const& triangles) {
  std::vector<std::pair<Triangle, std::size_t>> keys(triangles.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    keys[i] = {triangles[i], i};
    std::sort(keys[i].first.begin(), keys[i].first.end());
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::size_t> repeated;
  for (std::size_t i = 1; i < keys.size(); ++i) {
    if (keys[i].first == keys[i - 1].first) repeated.push_back(keys[i].second);
  }
  std::sort(repeated.begin(), repeated.end());
  return repeated;
}

}  // namespace

Surface make_surface(std::vector<Triangle> triangles, std::vector<int> object) {
  Surface surface;
  for (std::size_t i = 0; i < triangles.size(); ++i) check_triangle(triangles[i], i, object);
  std::vector<char> used(object.size(), 0);
  for (Triangle const& t : triangles) {
    for (std::int32_t const v : t) used[v] = 1;
  }
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v]) surface.vertices.push_back(static_cast<std::int32_t>(v));
  }
  surface.edges = edges_of(triangles);
  surface.triangles = std::move(triangles);
  surface.object = std::move(object);
  return surface;
}

SurfaceReport check_surface(Surface const& surface, std::string const& name) {
  SurfaceReport report;
  std::vector<Side> const sides = sorted_sides(surface.triangles);
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].edge == sides[i].edge) ++end;
    if (end == i + 1) report.open.push_back(sides[i].edge);
    if (end > i + 2) report.crowded.push_back(sides[i].edge);
    if (end == i + 2 && sides[i].forward == sides[i + 1].forward) {
      report.twisted.push_back(sides[i].edge);
    }
    i = end;
  }
  report.repeated = repeated_triangles(surface.triangles);
  if (!report.open.empty()) {
    report.warnings.push_back(fmt::format(
        "surface {}: {} of one triangle only, so it is open; close it if it bounds a body.", name,
        named(report.open)));
  }
  if (!report.crowded.empty()) {
    report.warnings.push_back(fmt::format(
        "surface {}: {} of more than two triangles, where it is not a manifold; mesh it again if "
        "that is not meant.",
        name, named(report.crowded)));
  }
  if (!report.twisted.empty()) {
    report.warnings.push_back(
        fmt::format("surface {}: {} between triangles of opposite orientation; turn the triangles "
                    "of one side around.",
                    name, named(report.twisted)));
  }
  if (!report.repeated.empty()) {
    report.warnings.push_back(
        fmt::format("surface {}: {} with the vertices of an earlier triangle, the first is number "
                    "{}; take them out.",
                    name, report.repeated.size(), report.repeated.front()));
  }
  return report;
}

EdgeLengths edge_lengths(Surface const& surface, std::span<Point const> points) {
  EdgeLengths lengths;
  if (surface.edges.empty()) return lengths;
  lengths.min = INFINITY;
  double sum = 0;
  for (Edge const& e : surface.edges) {
    Point const &a = points[e[0]], &b = points[e[1]];
    double const length = std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    sum += length;
    lengths.min = std::min(lengths.min, length);
    lengths.max = std::max(lengths.max, length);
  }
  lengths.mean = sum / static_cast<double>(surface.edges.size());
  return lengths;
}

double default_dhat(Surface const& surface, std::span<Point const> points) {
  std::map<int, std::pair<double, int>> of_body;  // the length of its edges, and their number
  for (Edge const& e : surface.edges) {
    Point const &a = points[e[0]], &b = points[e[1]];
    auto& [sum, count] = of_body[surface.object[e[0]]];
    sum += std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]);
    ++count;
  }
  double shortest = INFINITY;
  for (auto const& [body, edges] : of_body)
    shortest = std::min(shortest, edges.first / edges.second);
  return 0.3 * shortest;
}

double box_diagonal(Surface const& surface, std::span<Point const> points) {
  double square = 0;
  for (int c = 0; c < 3; ++c) {
    double low = INFINITY, high = -INFINITY;
    for (std::int32_t v : surface.vertices) {
      low = std::min(low, points[v][c]);
      high = std::max(high, points[v][c]);
    }
    if (high > low) square += (high - low) * (high - low);
  }
  return std::sqrt(square);
}

}  // namespace taut
