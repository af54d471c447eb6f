// A body of one density made ready for the solver: its mesh in locality-preserving order, its
// unknowns, and the way back to the input's order.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/fem/ordering.hpp>
#include <taut/core/fem/rest_shape.hpp>
#include <taut/core/potential/unknowns.hpp>

namespace taut {

template <class Precision = Mixed, class Space = DefaultSpace>
struct Body {
  using Positions = VectorField<typename Precision::position, Space>;

  Ordering order;
  TetMesh rest;  ///< in the solver's order, as the terms take it
  Unknowns<Precision, Space> unknowns;

  /// `mesh` at rest, m; `density` in kg/m^3.
  Body(TetMesh const& mesh, double density) : order(locality_order(mesh)) {
    for (std::int32_t v : order.vertices) rest.points.push_back(mesh.points[v]);
    for (std::int32_t t : order.tets) {
      Tet tet = mesh.tets[t];
      for (std::int32_t& v : tet) v = order.new_vertex[v];
      rest.tets.push_back(tet);
    }
    std::vector<double> const densities(rest.tets.size(), density);
    unknowns = Unknowns<Precision, Space>(lumped_mass(rest, densities), mean_edge_length(rest));
    assign(unknowns.prescribed, positions());
  }

  /// Holds the vertices whose rest position satisfies `where` at their rest position.
  template <class Where>
  void fix(Where const& where) {
    auto const fixed = Kokkos::create_mirror_view(unknowns.fixed);
    for (std::size_t i = 0; i < rest.points.size(); ++i) fixed(i) = where(rest.points[i]) ? 1 : 0;
    assign(unknowns.fixed, fixed);
  }

  /// The rest positions as a field.
  Positions positions() const {
    Positions const x("positions", rest.points.size());
    auto const host = Kokkos::create_mirror_view(x);
    for (std::size_t i = 0; i < rest.points.size(); ++i)
      for (int c = 0; c < 3; ++c) {
        host(i, c) = static_cast<typename Precision::position>(rest.points[i][c]);
      }
    assign(x, host);
    return x;
  }
  /// A field in the order of the input's vertices.
  std::vector<Point> in_input_order(Positions const& field) const {
    auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
    std::vector<Point> to(rest.points.size());
    for (std::size_t i = 0; i < to.size(); ++i)
      for (int c = 0; c < 3; ++c) to[order.vertices[i]][c] = double(host(i, c));
    return to;
  }
};

}  // namespace taut
