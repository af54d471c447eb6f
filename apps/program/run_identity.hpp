// What decides the course of a run: a checkpoint of one scene does not fit another.
#pragma once

#include <taut/apps/program/particle_geometry.hpp>
#include <taut/apps/program/scene_geometry.hpp>
#include <taut/core/io/checkpoint.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace taut {

/// What differs if anything does that a step depends on: the keys of the scene over its bases, by
/// the names that `--set` has, with [small] and overrides laid over them, the order of what has
/// names, and a hash of all that was read from meshes and masks. What only decides how long a run
/// is and what is written besides its frames is left out.
using RunIdentity = std::map<std::string, std::string>;

RunIdentity run_identity(SceneChanges const& changes, Scene const& scene,
                         SceneGeometry const& geometry);

/// The same of a scene of material points.
RunIdentity run_identity(SceneChanges const& changes, Scene const& scene,
                         SceneParticles const& particles);

void save(RunIdentity const& identity, Checkpoint& checkpoint);

/// A run may go on from `checkpoint` (at `path`) with another solver: says what has changed of it,
/// each as "solver.tolerance = 1e-4, it was 1e-3". Throws Error that names what else has changed.
std::vector<std::string> solver_changes(RunIdentity const& now, Checkpoint const& checkpoint,
                                        std::filesystem::path const& path);

}  // namespace taut
