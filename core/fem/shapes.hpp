// Procedural tetrahedral meshes: a lattice of cubes, split into tets, then mapped onto the shape.
//
// Split. Every cube gets a vertex at its centre; each face between two cubes gives four tets, one
// per edge of the face, with the two centres as apexes (the body-centred cubic lattice: all tets
// alike, dihedral angles 60 and 90 degrees); on the boundary a vertex in the middle of the face
// replaces the missing centre, which halves those tets (45, 60 and 90 degrees). Chosen over the
// six-tet Kuhn split because it has all 48 symmetries of the cube at every resolution, has no
// preferred diagonal, and no tet has two boundary faces, so a map may flatten an edge of the
// lattice without making slivers.
//
// Maps. Square and cube go to disk and ball by shells: the shell max|u_i| = s goes to the radius s
// with equal angles, x = s t/|t|, t_i = tan(pi/4 u_i/s). In the plane this is the area-preserving
// map of Shirley and Chiu 1997, "A low distortion map between disk and square"; in space it is the
// equiangular cubed sphere (Ronchi, Iacono, Paolucci 1996). Both are homogeneous of degree one, so
// refinement keeps the worst tet's shape; a smooth map cannot (it is singular where two faces
// become one surface). The disk becomes the bowl by equal angles from the pole.
//
// Boundary vertices lie on the exact surface, so the volume converges at second order. Every mesh
// is conforming and positively oriented, and its boundary is a closed manifold.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

#include <array>
#include <variant>
#include <vector>

namespace taut {

/// Axis-aligned box centred at the origin. Resolution: cells along the longest edge; along the
/// others the number that makes the cells most nearly cubes, at least one.
struct BoxShape {
  Point size{1, 1, 1};  ///< m
};

/// Union of boxes, each given by its lowest and highest corner, where given. Resolution: cells
/// along the longest edge of the bounding box; all corners must be vertices of that lattice.
struct BoxUnionShape {
  std::vector<std::array<Point, 2>> boxes;  ///< m
};

/// The letter E of the PNCG paper centred at the origin: 8/9 as wide (x) as high (y), a spine of
/// 2/9 and three arms of 1/9 of the height. Resolution: cells along the height, a multiple of 9.
struct LetterEShape {
  double height = 1.125;  ///< m
  double depth = 1;       ///< m, along z; rounded to whole cells, at least one
};

/// Circular cylinder centred at the origin. Resolution: cells across the diameter.
struct CylinderShape {
  double radius = 0.5;  ///< m
  double length = 1;    ///< m
  int axis = 1;         ///< 0, 1, 2: along x, y, z
};

/// Ball centred at the origin. Resolution: cells across the diameter.
struct SphereShape {
  double radius = 0.5;  ///< m
};

/// Torus around the y axis, centred at the origin. Resolution: cells across the tube's diameter.
struct TorusShape {
  double radius = 0.5;        ///< m, of the circle in the middle of the tube
  double tube_radius = 0.15;  ///< m, below `radius`
};

/// What lies between two balls around the origin and, seen from there, below the rim: a bowl that
/// is open at the top (y). Resolution: cells from rim to rim along the inside, at least as many as
/// a wall so thin needs to bend.
struct BowlShape {
  double radius = 0.5;      ///< m, of the inner ball
  double thickness = 0.05;  ///< m
  double height = 0.5;      ///< m, of the rim above the bottom, inside; at most 1.8 radii
};

/// A tube that widens into a cone, both around the y axis and open; they meet at the height of the
/// origin, the cone above. Resolution: cells from end to end along the inside. There, and around
/// it, are at least as many as a wall so thin needs to bend.
struct FunnelShape {
  double radius = 0.5;      ///< m, inside, at the top
  double throat = 0.15;     ///< m, inside, of the tube; below `radius`
  double height = 0.5;      ///< m, of the cone
  double spout = 0.2;       ///< m, length of the tube, above `thickness`
  double thickness = 0.05;  ///< m
};

/// Tets given one by one. Resolution: the pieces that each of their edges is cut into
/// (core/fem/subdivision.hpp).
struct TetsShape {
  TetMesh mesh;
};

using Shape = std::variant<BoxShape, BoxUnionShape, LetterEShape, CylinderShape, SphereShape,
                           TorusShape, BowlShape, FunnelShape, TetsShape>;

/// The tet mesh of a shape; vertices in lexicographic order of the lattice.
/// Throws Error for a size that is not positive and finite, a resolution below 1 or beyond 2^24
/// cells, boxes off the lattice, boxes that touch in an edge or a vertex only, a torus without a
/// hole, a funnel that does not narrow, and tets with a vertex that does not exist.
TetMesh make_shape(Shape const& shape, int resolution);

/// What a shape's resolution must be a multiple of: 9 for the letter E, the coarsest common lattice
/// of a union of boxes (1 if there is none), 1 for all others.
int resolution_unit(Shape const& shape);

}  // namespace taut
