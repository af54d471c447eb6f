// What a result says of a scene: its bodies as tets, its obstacles as triangles behind them.
#pragma once

#include <taut/apps/program/scene_geometry.hpp>
#include <taut/core/io/vtkhdf.hpp>

namespace taut {

/// The objects, then the obstacles, in the order of the scene. The points are where all of it is at
/// time 0, in the order of Simulation::positions(): the bodies', then those of the obstacles.
ResultMesh result_mesh(Scene const& scene, SceneGeometry const& geometry);

}  // namespace taut
