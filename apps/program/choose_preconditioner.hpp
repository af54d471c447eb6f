// Which preconditioner serves a scene, where it does not say: the choice is by how far a step
// reaches. A wave crosses
//
//   c h / l,   c = sqrt(E / rho),   l the mean edge,
//
// elements in a step h, and as many rings of neighbours answer to a change of one vertex. A local
// preconditioner passes on one ring per iteration; one of aggregates with a coarse level passes on
// all of them, and costs about twice as much per iteration.
#pragma once

#include <taut/apps/program/scene_geometry.hpp>

namespace taut {

/// The largest c h / l of all materials.
double elements_per_step(Scene const& scene, SceneGeometry const& geometry);

struct PreconditionerChoice {
  std::string name;    ///< never "auto"
  std::string reason;  ///< a clause: "asked for", or what decided
};

PreconditionerChoice choose_preconditioner(Scene const& scene, SceneGeometry const& geometry);

/// The scene with the choice in its solver options.
Scene with_chosen_preconditioner(Scene scene, SceneGeometry const& geometry);

}  // namespace taut
