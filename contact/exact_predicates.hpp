// The two signs that every exact answer about points, segments and triangles in space is made of,
// computed without error:
//
//   orientation             sign det[b - a | c - a | d - a]: on which side of the plane a b c is d;
//   projected_orientation   sign of one component of (b - a) x (c - a): how a b c turn, seen along
//                           an axis.
//
// Coordinates are compared as they are, and dropping one is exact, so nothing else needs care.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

namespace taut {

/// 1, 0 or -1; 0 if and only if the four points lie in a plane. Positive where d is on the side
/// from which a, b, c turn counter-clockwise. The coordinates must be finite, and may be as large
/// or as small as doubles are.
int orientation(Point const& a, Point const& b, Point const& c, Point const& d);

/// The sign of component `axis` (0, 1, 2) of (b - a) x (c - a): 1, 0 or -1. It is 0 for all three
/// axes if and only if the points lie on a line.
int projected_orientation(Point const& a, Point const& b, Point const& c, int axis);

}  // namespace taut
