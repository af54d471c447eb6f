// Problems of the truth tests: meshes and scenes put together by hand, on the program's compiled
// terms and minimisers.
#pragma once

#include "scene_text.hpp"

#include <taut/apps/program/methods.hpp>
#include <taut/apps/program/simulation.hpp>
#include <taut/core/fem/body.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/fem/shapes.hpp>

#include <cmath>

namespace taut::test {

/// Options of [solver] from "key=value" pairs.
inline SolverOptions solver(std::vector<std::string> const& overrides) {
  ScratchFolder const folder;
  SceneChanges changes;
  for (std::string const& o : overrides) changes.overrides.push_back("solver." + o);
  return load_scene(folder.write("plain.toml", plain_scene), changes).solver;
}

/// The reference of the truth tests: Newton to round-off.
inline std::vector<std::string> tight_newton(double tolerance = 1e-10) {
  return {"precision=fp64", "method=newton", "hessian=direct",
          fmt::format("tolerance={}", tolerance), "max_iterations=200"};
}

/// Keys of [solver] as overrides of a scene.
inline std::vector<std::string> of_solver(std::vector<std::string> keys) {
  for (std::string& key : keys) key = "solver." + key;
  return keys;
}

/// A scene file changed by overrides, ready to be stepped.
struct Trial {
  Scene scene;
  SceneGeometry geometry;
  std::unique_ptr<Simulation> simulation;

  Trial(std::string const& name, std::vector<std::string> const& overrides, bool small = false)
      : Trial(load_scene(scene_folder() / (name + ".toml"), {small, overrides})) {}
  explicit Trial(Scene s) : scene(std::move(s)), geometry(build_geometry(scene)) { reset(); }
  /// After a change of the geometry.
  void reset() { simulation = Simulation::create(scene, geometry); }
};

/// Lumped masses of a scene's vertices, kg.
inline std::vector<double> masses(SceneGeometry const& geometry) {
  std::vector<double> density;
  for (int m : geometry.material_of_tet) density.push_back(geometry.materials[m].density);
  return lumped_mass(geometry.mesh, density);
}

inline std::vector<Point> after(Trial& trial, int steps) {
  for (int k = 0; k < steps; ++k) trial.simulation->step();
  return trial.simulation->positions();
}

/// Mass-weighted rms of the difference over the vertices that no pin holds, m.
inline double rms_difference(SceneGeometry const& geometry, std::vector<Point> const& x,
                             std::vector<Point> const& y) {
  auto mass = masses(geometry);
  for (Pin const& pin : geometry.pins) {
    for (int v : pin.vertices) mass[v] = 0;
  }
  double square = 0, total = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (int c = 0; c < 3; ++c) square += mass[i] * (x[i][c] - y[i][c]) * (x[i][c] - y[i][c]);
    total += mass[i];
  }
  return std::sqrt(square / total);
}

/// F of one tet at positions x.
inline Mat3<double> deformation(TetMesh const& rest, std::size_t t, std::vector<Point> const& x) {
  Mat3<double> edges;
  Tet const& tet = rest.tets[t];
  for (int a = 0; a < 3; ++a)
    for (int c = 0; c < 3; ++c) edges(c, a) = x[tet[a + 1]][c] - x[tet[0]][c];
  return edges * rest_shape(rest.points, tet).B;
}

/// Elastic energy of a scene at positions x, J; straight from the definition.
inline double elastic_energy(SceneGeometry const& geometry, std::vector<Point> const& x) {
  double sum = 0;
  for (std::size_t t = 0; t < geometry.mesh.tets.size(); ++t) {
    MaterialParameters const& m = geometry.materials[geometry.material_of_tet[t]];
    Lame<double> const lame = lame_parameters(m.young, m.poisson);
    Mat3<double> const F = deformation(geometry.mesh, t, x);
    sum += rest_shape(geometry.mesh.points, geometry.mesh.tets[t]).W *
           ElasticModels::with(m.model, [&]<class Model>() { return energy<Model>(lame, F); });
  }
  return sum;
}

/// An elastic body of one material as a potential, with some vertices fixed.
template <class P = Fp64>
struct ElasticProblem {
  TetMesh rest;  ///< in the solver's order
  Unknowns<P> unknowns;
  ProgramTerms<P> terms;
  VectorField<typename P::position, DefaultSpace> x;

  /// Fixes the vertices whose rest position satisfies the predicate.
  template <class Model, class Fixed>
  static ElasticProblem make(TetMesh const& mesh, Lame<double> const& material,
                             Fixed const& fixed) {
    Body<P> body(mesh, 1000);
    body.fix(fixed);
    ElasticProblem problem{body.rest, body.unknowns, {}, body.positions()};
    add_elastic_term<Model, P>(
        problem.terms, {problem.rest, {material}, std::vector<int>(problem.rest.tets.size(), 0)},
        "clamp");
    return problem;
  }

  /// Static equilibrium under forces per vertex (N).
  NewtonReport solve(VectorField<typename P::real, DefaultSpace> const& forces = {},
                     std::vector<std::string> const& options = tight_newton(1e-11)) {
    ProgramPotential<P> potential(unknowns, Inertia<P>(unknowns), BodyForce<P>(unknowns), terms,
                                  {});
    potential.template term<BodyForce<P>>().set_forces(forces);
    potential.template term<Inertia<P>>().switch_on(false);
    potential.begin_step(x, 1, 1, false);
    AnyMinimiser<P> newton(solver(options));
    return newton.minimise(potential, x, {});
  }

  /// Elastic forces dV/dx on all vertices, N: at fixed ones those that the support must bear.
  VectorField<typename P::real, DefaultSpace> elastic_forces() const {
    std::size_t const n = rest.points.size();
    FixedMask<DefaultSpace> const none("none", n);
    VectorField<typename P::real, DefaultSpace> const f("f", n);
    terms.add_gradient(x, 1.0, none, f);
    return f;
  }
};

}  // namespace taut::test
