// How much memory a scene will take, so that too large a mesh is refused before it is built.
#pragma once

#include <taut/apps/program/scene_geometry.hpp>

namespace taut {

/// How large a mesh is or will be.
struct MeshSize {
  double vertices = 0;
  double tets = 0;
};

/// Of all objects of a scene, before anything is built: from the lattices of shapes and the headers
/// of mesh files, or their length where there is no header. Right to some ten percent.
MeshSize estimate_size(Scene const& scene);
MeshSize size_of(SceneGeometry const& geometry);

/// Bytes, an upper estimate of what meshing, checking and stepping take at a time.
double memory_needed(MeshSize const& size, SolverOptions const& solver);
/// Bytes that the system, and a control group (1 or 2) that this process is in, can still give;
/// infinity where they do not say. `root`: of /proc and /sys.
double memory_available(std::filesystem::path const& root = "/");
/// Throws Error if a mesh of this size needs more than there is.
void require_memory(MeshSize const& size, SolverOptions const& solver);

/// Bytes that so many material points take with their grid and solver, an upper estimate.
/// `per_cell`: how many of them there are in a cell.
double particle_memory_needed(double particles, double per_cell, SolverOptions const& solver);
/// Throws Error if a scene of so many material points needs more than there is.
void require_particle_memory(double particles, double per_cell, SolverOptions const& solver);

/// build_geometry() once it is known to fit; says so on stderr if it will take long.
SceneGeometry build_within_memory(Scene const& scene);

}  // namespace taut
