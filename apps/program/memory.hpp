// How much memory a scene will take, so that too large a mesh is refused before it is built.
#pragma once

#include <taut/apps/program/scene_geometry.hpp>

namespace taut {

/// Bytes, an upper estimate from the number of tets and vertices and the solver's data structures.
double memory_needed(SceneGeometry const& geometry, SolverOptions const& solver);
/// Bytes that the system can give; infinity where it does not say.
double memory_available();
/// Throws Error if the scene needs more than there is.
void require_memory(SceneGeometry const& geometry, SolverOptions const& solver);

}  // namespace taut
