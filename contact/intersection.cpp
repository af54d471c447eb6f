#include <taut/contact/intersection.hpp>

#include <taut/contact/box_tree.hpp>
#include <taut/contact/winding_number.hpp>
#include <taut/core/fem/connected.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cmath>
#include <set>

namespace taut {

namespace {

template <std::size_t n>
std::array<Point, n> corners(std::span<Point const> x, std::array<std::int32_t, n> const& simplex) {
  std::array<Point, n> points;
  for (std::size_t k = 0; k < n; ++k) points[k] = x[simplex[k]];
  return points;
}

template <class Simplex>
std::vector<Box> boxes_of(std::span<Point const> x, std::vector<Simplex> const& simplices) {
  std::vector<Box> boxes;
  boxes.reserve(simplices.size());
  for (Simplex const& s : simplices) boxes.push_back(Box::around(corners(x, s)));
  return boxes;
}

bool share_vertex(Edge const& edge, Triangle const& triangle) {
  return std::any_of(triangle.begin(), triangle.end(),
                     [&](std::int32_t v) { return v == edge[0] || v == edge[1]; });
}

/// Where the edge passes the plane of the triangle, or as near as rounding lets that be; in any
/// case within both of their boxes.
Point place_of(std::array<Point, 2> const& edge, std::array<Point, 3> const& triangle) {
  const auto away = [](Point const& from, Point const& to) {
    return Point{to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  };
  Point const u = away(triangle[0], triangle[1]), v = away(triangle[0], triangle[2]);
  const auto height = [&](Point const& x) {
    Point const w = away(triangle[0], x);
    return w[0] * (u[1] * v[2] - u[2] * v[1]) + w[1] * (u[2] * v[0] - u[0] * v[2]) +
           w[2] * (u[0] * v[1] - u[1] * v[0]);
  };
  double const above = height(edge[0]), below = height(edge[1]);
  double const share = above / (above - below);
  Box const e = Box::around(edge), t = Box::around(triangle);
  Point place;
  for (std::size_t c = 0; c < 3; ++c) {
    double const low = std::max(e.low[c], t.low[c]), high = std::min(e.high[c], t.high[c]);
    double const at = edge[0][c] + share * (edge[1][c] - edge[0][c]);
    place[c] = std::isfinite(at) ? std::clamp(at, low, high) : low / 2 + high / 2;
  }
  return place;
}

/// The body of all of the vertices.
template <std::size_t n>
std::int32_t body_of(std::array<std::int32_t, n> const& simplex,
                     std::vector<std::int32_t> const& body) {
  for (std::int32_t const v : simplex) {
    if (v < 0 || static_cast<std::size_t>(v) >= body.size())
      throw Error("intersection test: vertex {} is not one of the {}", v, body.size());
    std::int32_t const first = body[simplex[0]];
    std::int32_t const its = body[v];
    if (its != first || its < 0)
      throw Error("intersection test: vertices {} and {} of one {} are of the bodies {} and {}",
                  simplex[0], v, n == 2 ? "edge" : "triangle", first, its);
  }
  return body[simplex[0]];
}

}  // namespace

std::string Intersection::text(std::span<std::string const> names) const {
  const auto name = [&](std::int32_t body) { return names[body]; };
  std::string const at = fmt::format("({:.6g}, {:.6g}, {:.6g})", place[0], place[1], place[2]);
  if (kind == IntersectionKind::inside) {
    return fmt::format("{} is inside {}: its vertex {} at {}", name(edge_body), name(triangle_body),
                       edge[0], at);
  }
  char const* const does = kind == IntersectionKind::crossing   ? "crosses"
                           : kind == IntersectionKind::touching ? "touches"
                                                                : "overlaps, in its plane,";
  std::string const owner = edge_body == triangle_body ? "the same" : name(triangle_body);
  return fmt::format("edge {}-{} of {} {} triangle {}-{}-{} of {} at {}", edge[0], edge[1],
                     name(edge_body), does, triangle[0], triangle[1], triangle[2], owner, at);
}

IntersectionTest::IntersectionTest(IntersectionMesh mesh) : mesh_(std::move(mesh)) {
  std::int32_t count = 0;
  for (Triangle const& t : mesh_.triangles) count = std::max(count, body_of(t, mesh_.body) + 1);
  for (Edge const& e : mesh_.edges) count = std::max(count, body_of(e, mesh_.body) + 1);
  bodies_.resize(static_cast<std::size_t>(count));
  for (Triangle const& t : mesh_.triangles) bodies_[body_of(t, mesh_.body)].triangles.push_back(t);
  for (Body& body : bodies_) body.closed = is_closed(body.triangles);
  auto const first = smallest_connected(mesh_.body.size(), mesh_.triangles);
  for (Triangle const& t : mesh_.triangles) first_of_part_.push_back(first[t[0]]);
  std::sort(first_of_part_.begin(), first_of_part_.end());
  first_of_part_.erase(std::unique(first_of_part_.begin(), first_of_part_.end()),
                       first_of_part_.end());
}

std::vector<Intersection> IntersectionTest::find(std::span<Point const> x) const {
  require_finite(x);
  std::vector<Intersection> found = meeting(x);
  add_inside(x, found);
  return found;
}

void IntersectionTest::require_finite(std::span<Point const> x) const {
  if (x.size() != mesh_.body.size())
    throw Error("intersection test: {} positions for {} vertices", x.size(), mesh_.body.size());
  const auto require = [&](auto const& simplex) {
    for (std::int32_t const v : simplex)
      for (double const c : x[v])
        if (!std::isfinite(c))
          throw Error("intersection test: the position of vertex {} is not finite", v);
  };
  for (Triangle const& t : mesh_.triangles) require(t);
  for (Edge const& e : mesh_.edges) require(e);
}

std::vector<Intersection> IntersectionTest::meeting(std::span<Point const> x) const {
  BoxTree const tree(boxes_of(x, mesh_.triangles));
  std::vector<Intersection> found;
  std::vector<std::int32_t> near;
  for (Edge const& e : mesh_.edges) {
    auto const ends = corners(x, e);
    tree.find(Box::around(ends), near);
    for (std::int32_t const k : near) {
      Triangle const& t = mesh_.triangles[k];
      if (share_vertex(e, t)) continue;
      auto const abc = corners(x, t);
      auto const kind = intersect(ends[0], ends[1], abc[0], abc[1], abc[2]);
      if (!kind) continue;
      found.push_back({*kind, e, t, mesh_.body[e[0]], mesh_.body[t[0]], place_of(ends, abc)});
    }
  }
  return found;
}

void IntersectionTest::add_inside(std::span<Point const> x,
                                  std::vector<Intersection>& found) const {
  // A surface that meets nothing of a body is on one side of it as a whole.
  std::set<std::array<std::int32_t, 2>> settled;
  for (Intersection const& i : found) {
    settled.insert({i.edge_body, i.triangle_body});
    settled.insert({i.triangle_body, i.edge_body});
  }
  std::vector<std::int32_t> closed;
  std::vector<Box> boxes;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    if (!bodies_[b].closed || bodies_[b].triangles.empty()) continue;
    closed.push_back(static_cast<std::int32_t>(b));
    Box box = Box::around(corners(x, bodies_[b].triangles[0]));
    for (Triangle const& t : bodies_[b].triangles) box.include(Box::around(corners(x, t)));
    boxes.push_back(box);
  }
  BoxTree const tree(boxes);
  std::vector<std::int32_t> near;
  for (std::int32_t const v : first_of_part_) {
    Point const& place = x[v];
    std::int32_t const inner = mesh_.body[v];
    tree.find({place, place}, near);
    for (std::int32_t const k : near) {
      std::int32_t const outer = closed[k];
      if (outer == inner) continue;
      if (settled.contains({inner, outer})) continue;
      if (winding_number(x, bodies_[outer].triangles, place) == 0) continue;
      settled.insert({inner, outer});
      found.push_back({IntersectionKind::inside, {v, v}, {-1, -1, -1}, inner, outer, place});
    }
  }
}

}  // namespace taut
