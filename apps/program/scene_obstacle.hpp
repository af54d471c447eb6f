// Obstacles as triangles: the surfaces that bodies touch, and pictures of the analytic ones.
#pragma once

#include <taut/apps/program/scene.hpp>

#include <array>
#include <string>
#include <vector>

namespace taut {

/// The surface of an obstacle that is one (SceneObstacle::is_surface), at time 0. A closed one is
/// oriented outward. Warns of what is open or no manifold: contact works on both sides of it, but
/// it has no inside. Throws Error for a file that cannot be read, and triangles without area.
TriangleMesh obstacle_surface(SceneObstacle const& obstacle, std::vector<std::string>& warnings);

/// Triangles to draw an obstacle with, at time 0: a surface as it is; of a half space a square
/// patch of its plane, twice as wide as the diagonal of `around` ([lowest corner, highest corner]
/// of the bodies, m) and under its centre; of the others their wall, seen from within. `resolution`
/// (at least 1) is the number of cells across an analytic one.
TriangleMesh triangles_of(SceneObstacle const& obstacle, std::array<Point, 2> const& around,
                          int resolution);

}  // namespace taut
