// Whether an edge and a triangle have a point in common, decided exactly for any finite
// coordinates: triangles without area and edges without length included.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

#include <cstdint>
#include <optional>

namespace taut {

/// By what two closed sets, an edge and a triangle, have in common.
enum class IntersectionKind : std::uint8_t {
  crossing,  ///< one point, inside the edge and inside the triangle, whose plane the edge leaves
  touching,  ///< any other single point: an end, a corner, a point of a side; all that a point or
             ///< two segments that cross can have in common
  overlap,   ///< a segment: the edge lies in the plane, or on the line, of the triangle
  inside     ///< not of edges: a body lies wholly inside another (intersection.hpp)
};

/// What the segment p q and the triangle a b c have in common; nothing if they are apart. Does not
/// depend on the order of p, q and of a, b, c. The coordinates must be finite.
std::optional<IntersectionKind> intersect(Point const& p, Point const& q, Point const& a,
                                          Point const& b, Point const& c);

}  // namespace taut
