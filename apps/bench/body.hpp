// The body that the bench sweeps over: a cube of tets in the solver's order, bent and sheared.
#pragma once

#include <taut/apps/program/methods.hpp>
#include <taut/core/exec/copy.hpp>

#include <string>
#include <vector>

namespace taut {

/// A unit cube of about `tets` tets.
struct BenchBody {
  TetMesh rest;  ///< in the solver's order
  std::vector<double> mass;
  double edge;  ///< mean length, m

  explicit BenchBody(int tets);
  double vertices_per_tet() const { return double(rest.points.size()) / double(rest.tets.size()); }
};

/// Where the vertex with rest position X is: strains of some ten per cent and rotations, J > 0.
Point bench_position(Point const& X);
/// A direction as smooth as those of a minimiser.
Point bench_direction(Point const& X);

/// Nonlinear CG by Dai and Kou with Jacobi and a check of sufficient decrease, for `iterations`.
SolverOptions bench_pncg(int iterations);

/// A field of the program's order and precision with `where` of each rest position.
template <class T, class Where>
VectorField<T, DefaultSpace> bench_field(BenchBody const& body, Where const& where) {
  VectorField<T, DefaultSpace> field("bench_field", body.rest.points.size());
  auto const host = Kokkos::create_mirror_view(field);
  for (std::size_t i = 0; i < body.rest.points.size(); ++i) {
    Point const p = where(body.rest.points[i]);
    for (int c = 0; c < 3; ++c) host(i, c) = static_cast<T>(p[c]);
  }
  assign(field, host);
  return field;
}

/// The elastic term of the model of this name.
template <class P>
ProgramTerms<P> bench_terms(BenchBody const& body, std::string const& model) {
  ElasticPart part;
  part.rest = body.rest;
  part.materials = {lame_parameters(1e5, 0.4)};
  part.material_of_tet.assign(body.rest.tets.size(), 0);
  ProgramTerms<P> terms;
  ElasticModels::with(model, [&]<class Model>() {
    add_elastic_term<Model, P>(terms, part, "clamp");
    return true;
  });
  return terms;
}

}  // namespace taut
