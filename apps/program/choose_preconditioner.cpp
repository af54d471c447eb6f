#include <taut/apps/program/choose_preconditioner.hpp>
#include <taut/core/fem/rest_shape.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace taut {

namespace {

/// Elements per step from which on a coarse level pays. Measured on a letter E (h = 0.01 s, edges
/// of 0.1 m, error of 0.01 in one run each): at 1.4 elements per step block Jacobi is 2.4 times as
/// fast, at 4.5 elements half as fast, at 45 and above seven times as slow. With contact, at 6
/// elements (forty-eight letters, small) the coarse level takes 0.59 of the time, at 7 along thin
/// rods (noodles, small) 1.3 of it.
constexpr double far = 3;

}  // namespace

double elements_per_step(Scene const& scene, SceneGeometry const& geometry) {
  double fastest = 0;
  for (MaterialParameters const& m : geometry.materials) {
    fastest = std::max(fastest, std::sqrt(m.young / m.density));
  }
  return fastest * scene.step / mean_edge_length(geometry.mesh);
}

PreconditionerChoice choose_preconditioner(Scene const& scene, SceneGeometry const& geometry) {
  std::string const& asked = scene.solver.text("preconditioner");
  if (asked != "auto") return {asked, "asked for"};
  if (scene.scheme == TimeScheme::quasi_static) {
    return {"schwarz_32", "without inertia every part of a body answers to every other"};
  }
  double const reach = elements_per_step(scene, geometry);
  return {reach < far ? "block_jacobi" : "schwarz_32",
          fmt::format("a wave crosses {:.2g} elements per step, {} {:g}", reach,
                      reach < far ? "less than" : "no less than", far)};
}

Scene with_chosen_preconditioner(Scene scene, SceneGeometry const& geometry) {
  scene.solver.set("preconditioner", choose_preconditioner(scene, geometry).name);
  return scene;
}

}  // namespace taut
