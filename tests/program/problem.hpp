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

/// An elastic body of one material in fp64 as a potential, with vertices fixed by a predicate.
struct ElasticProblem {
  TetMesh rest;  ///< in the solver's order
  Unknowns<Fp64> unknowns;
  ProgramTerms<Fp64> terms;
  VectorField<double, DefaultSpace> x;

  template <class Model, class Fixed>
  static ElasticProblem make(TetMesh const& mesh, Lame<double> const& material,
                             Fixed const& fixed) {
    Body<Fp64> body(mesh, 1000);
    body.fix(fixed);
    ElasticProblem problem{body.rest, body.unknowns, {}, body.positions()};
    add_elastic_term<Model, Fp64>(
        problem.terms, {problem.rest, {material}, std::vector<int>(problem.rest.tets.size(), 0)},
        "clamp");
    return problem;
  }

  /// Static equilibrium under forces per vertex (N), with Newton.
  NewtonReport solve(VectorField<double, DefaultSpace> const& forces = {}) {
    ProgramPotential<Fp64> potential(unknowns, Inertia<Fp64>(unknowns), BodyForce<Fp64>(unknowns),
                                     terms);
    potential.term<BodyForce<Fp64>>().set_forces(forces);
    potential.term<Inertia<Fp64>>().switch_on(false);
    potential.begin_step(1, 1, false);
    AnyMinimiser<Fp64> newton(solver(tight_newton(1e-11)));
    return newton.minimise(potential, x, {});
  }

  /// Elastic forces dV/dx on all vertices, N: at fixed ones those that the support must bear.
  VectorField<double, DefaultSpace> elastic_forces() const {
    std::size_t const n = rest.points.size();
    FixedMask<DefaultSpace> const none("none", n);
    VectorField<double, DefaultSpace> const f("f", n);
    terms.add_gradient(x, 1.0, none, f);
    return f;
  }
};

}  // namespace taut::test
