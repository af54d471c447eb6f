// Bodies as sets of points, on the host: what particles are sampled from.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>
#include <taut/core/math/rigid_pose.hpp>

#include <filesystem>
#include <functional>
#include <string>

namespace taut {

/// A bounded set: which points are in it, a box around it, and its volume.
struct Solid {
  std::function<bool(Vec3<double> const&)> holds;
  Vec3<double> lowest{}, highest{};  ///< m
  double volume = 0;                 ///< m^3
};

// Around the origin, sizes in m. Throw Error for a size that is not above zero.

Solid solid_box(Vec3<double> const& lengths);
Solid solid_ball(double radius);
/// Axis y.
Solid solid_cylinder(double radius, double height);
/// Axis y: a circle of radius `ring` in the plane of x and z, thick by `section` < ring around it.
Solid solid_torus(double ring, double section);

/// The inside of a closed surface: where it winds around a point. Rays along z decide; whether a
/// ray passes left or right of an edge is computed once for both of its triangles, so that a ray
/// through an edge or a corner is counted as one that passes by. Where a ray leaves the surface
/// more often than it enters it (there is a hole), rays along x and y are asked.
///
/// Throws Error for a surface without inside, with a vertex that is not finite, or with more than
/// `open` of its edges at holes (0: it must be closed). `name` stands for it in messages.
Solid solid_in_surface(TriangleMesh const& surface, std::string const& name, double open = 0);

/// The inside of a level set of an OpenVDB file: where the field is below zero. The first grid of
/// floats that is a level set is taken. Throws Error if there is none, or if it has no inside.
Solid solid_in_level_set(std::filesystem::path const& file);

/// The surface of that level set, its normals outward, m. Throws Error as above.
TriangleMesh surface_of_level_set(std::filesystem::path const& file);

/// The same body elsewhere.
Solid placed(Solid const& solid, RigidPose const& pose);
/// What is in `solid` and not in `hole`; its volume is measured by a fine grid of points.
Solid without(Solid const& solid, Solid const& hole);

}  // namespace taut
