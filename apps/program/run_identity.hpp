// What decides the course of a run: a checkpoint of one scene does not fit another.
#pragma once

#include <taut/apps/program/particle_geometry.hpp>
#include <taut/apps/program/scene_geometry.hpp>

#include <string>

namespace taut {

/// A text that differs if anything does that a step depends on: the keys of the scene over its
/// bases, with [small] and overrides laid over them, and all that was read from meshes and masks.
/// What only decides how long a run is and what is written besides its frames is left out.
std::string run_identity(SceneChanges const& changes, Scene const& scene,
                         SceneGeometry const& geometry);

/// The same of a scene of material points.
std::string run_identity(SceneChanges const& changes, Scene const& scene,
                         SceneParticles const& particles);

}  // namespace taut
