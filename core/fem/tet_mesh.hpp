// A tetrahedral mesh as it is read, written and placed: plain host data in the input's order.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace taut {

using Point = std::array<double, 3>;
using Tet = std::array<std::int32_t, 4>;
using Triangle = std::array<std::int32_t, 3>;
using Edge = std::array<std::int32_t, 2>;

struct TetMesh {
  std::vector<Point> points;  ///< metres
  std::vector<Tet> tets;      ///< vertex indices; positive orientation: det[x1-x0|x2-x0|x3-x0] > 0
};

struct TriangleMesh {
  std::vector<Point> points;        ///< metres
  std::vector<Triangle> triangles;  ///< counter-clockwise seen from outside
};

/// The faces that belong to exactly one tet, oriented outward for positively oriented tets. Vertex
/// indices are those of the tet mesh.
std::vector<Triangle> boundary_faces(std::vector<Tet> const& tets);

/// The boundary of a tet mesh as a surface of its own: its vertices in the order of the mesh,
/// without those inside.
TriangleMesh boundary_surface(TetMesh const& mesh);

/// The edges of the triangles: each once, the smaller vertex first, in lexicographic order.
std::vector<Edge> edges_of(std::span<Triangle const> triangles);

}  // namespace taut
