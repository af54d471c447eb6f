// Sources: what lets material points out. A cloud of blue noise, endless along the flow, moves
// through a convex shape with a velocity u; a point is a particle from the moment it leaves the
// shape. The moments are known beforehand: a point on the line y + s u / |u| that leaves the shape
// at s = out, and is at s = 0 at the start, leaves it after out / |u| seconds. What comes out at a
// time is thus a part of one list from its beginning, whatever the steps are.
//
// Volume is exact: particles of a source have one volume V, so that what leaves it until it ends
// (or, if it never ends, while its cloud repeats itself once) is together A |u| T, with A the area
// of the shape's shadow along u. (Sources as in the code of Wang et al. 2020, which carries the
// cloud step by step and has no such volume.)
#pragma once

#include <taut/mpm/boundary.hpp>
#include <taut/mpm/sampling.hpp>

#include <string>
#include <vector>

namespace taut {

/// In the shape's own frame.
struct SourceSpec {
  std::string name = {};
  BoundaryShape shape = BoundaryShape::ball;  ///< box, ball or cylinder, sizes as in BoundarySpec
  Vec3<double> size{};                        ///< m
  Vec3<double> velocity{};                    ///< of the flow, m/s
  double per_cell = 8;                        ///< particles in a cell
  double start = 0;                           ///< s
  double end = std::numeric_limits<double>::infinity();  ///< s
};

struct Outflow {
  struct Point {
    double time;         ///< when it leaves the shape, s
    Vec3<double> place;  ///< and where, in the shape's frame, m
  };
  std::vector<Point> points;  ///< in the order of time
  double volume = 0;          ///< of each of them, m^3
};

/// The area of the shape's shadow along a direction of length 1, m^2.
double shadow(SourceSpec const& source, Vec3<double> const& direction);

/// What leaves the source up to the time `until`, s, for a grid of spacing dx, m. A later `until`
/// adds points behind those of an earlier one. Throws Error for a shape that is none of the three,
/// a flow that stands still, a source without room for a particle, and one with more than 1e9 of
/// them.
Outflow outflow(SourceSpec const& source, double dx, double until, std::uint64_t seed);

}  // namespace taut
