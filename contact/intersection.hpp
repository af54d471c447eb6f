// The exact intersection test: all pairs of an edge and a triangle without a common vertex that
// have a point in common, and all bodies that lie wholly inside another one.
//
// It is what holds the promise that no accepted state intersects, and is independent of what is to
// keep it: it shares no code with the contact term, its broad phase and its step bounds. Two
// triangles without a common vertex have a point in common if and only if a side of one meets the
// other, so that the pairs of edges and triangles are enough. Signs are exact
// (exact_predicates.hpp): fp64 and fp32 positions are judged as they are, and there is no
// tolerance.
//
// A pair that touches is at distance zero, and counts like any other.
//
// What it does not see: a pair with a common vertex that folds onto itself, where no other edge
// touches a triangle; edges without triangles among themselves.
#pragma once

#include <taut/contact/edge_triangle.hpp>

#include <array>
#include <span>
#include <string>
#include <vector>

namespace taut {

/// What may intersect. Bodies count from 0; a triangle or edge is of the body of its vertices.
struct IntersectionMesh {
  std::vector<Triangle> triangles;  ///< of closed bodies: counter-clockwise seen from outside
  std::vector<Edge> edges;          ///< those of the triangles, and any others
  std::vector<std::int32_t> body;   ///< per vertex
};

struct Intersection {
  IntersectionKind kind;
  Edge edge;          ///< vertices; where a body is inside another: twice a vertex of it
  Triangle triangle;  ///< vertices; where a body is inside another: three times -1
  std::int32_t edge_body;
  std::int32_t triangle_body;  ///< the body around the other one, where that is inside
  Point place;                 ///< m, a point near to both; exact but for rounding for a crossing

  /// "edge 12-15 of ball crosses triangle 3-7-9 of floor at (0.1, 0, 2)"; `names` of the bodies.
  std::string text(std::span<std::string const> names) const;
};

class IntersectionTest {
public:
  /// Throws Error for a vertex that does not exist, and for a triangle or an edge of two bodies.
  explicit IntersectionTest(IntersectionMesh mesh);

  /// All intersections at positions x (m, one per vertex), by edge, then by triangle; then the
  /// bodies inside others, by vertex, once per pair. A body is inside another if that is closed,
  /// any connected part of the body is within it, and none of their edges and triangles meet. What
  /// is inside an open surface has no meaning, and is not asked. Throws Error if the number of
  /// positions is wrong or a vertex of the mesh is not finite.
  std::vector<Intersection> find(std::span<Point const> x) const;

private:
  struct Body {
    std::vector<Triangle> triangles;
    bool closed;
  };

  void require_finite(std::span<Point const> x) const;
  std::vector<Intersection> meeting(std::span<Point const> x) const;
  void add_inside(std::span<Point const> x, std::vector<Intersection>& found) const;

  IntersectionMesh mesh_;
  std::vector<Body> bodies_;
  std::vector<std::int32_t> first_of_part_;  ///< a vertex of each connected part of the triangles
};

}  // namespace taut
