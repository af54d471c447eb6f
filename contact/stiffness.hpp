// How stiff a pair in contact is: policies that give the K (N/m) of E = K m(q) b(d) (pair.hpp).
//
//   GivenStiffness             K = P A / dhat: a layer of thickness dhat that resists like a
//                              material of modulus P. The share of dhat that is left at rest
//                              depends on the load over P alone, not on the time step, and on the
//                              mesh only as far as that carries the load through other pairs.
//   ElasticInclusiveStiffness  K = mean over the vertices of m / h^2 + the diagonal of the elastic
//                              Hessian: what resists the pair in this step (StepStart). One setting
//                              serves all moduli, but the gap depends on the step. The default.
//
// A is a quarter of the smaller of the areas that the two sides stand for, for two surfaces that
// lie on each other meet as points of the first, as points of the second, and where edges cross,
// about 4 A in all (isotropic meshes of equilateral triangles: 1 + 1 + 2.2).
//
// K is frozen within a step and does not follow the closest points: it would be a function of x
// that no gradient knows of.
#pragma once

#include <taut/contact/candidates.hpp>
#include <taut/core/potential/unknowns.hpp>
#include <taut/core/report/error.hpp>

namespace taut {

/// What stiffness rules may look at; one entry per vertex of the mesh.
template <class Precision, class S>
struct StiffnessFields {
  Array<typename Precision::real, S> area;       ///< a third of the triangles around, at rest, m^2
  Array<typename Precision::real, S> stiffness;  ///< StepStart::stiffness, N/m
  FixedMask<S> fixed;
  double dhat;  ///< m
};

/// A rule: the K of the pair of vertices v, N/m. `per_vertex`: it needs the field `stiffness`.
template <class R, class Precision, class S>
concept StiffnessRule = requires(R const& rule, StiffnessFields<Precision, S> const& fields,
                                 PairKind kind, int const (&v)[4]) {
  { R::name } -> std::convertible_to<char const*>;
  { R::per_vertex } -> std::convertible_to<bool>;
  { rule.valid() } -> std::same_as<bool>;
  { rule(fields, kind, v) } -> std::same_as<double>;
};

/// A rule that also knows the K of vertex v, N/m, against what does not give way and is no mesh.
/// All of the field `area` counts there: nothing else of the surface meets it.
template <class R, class Precision, class S>
concept VertexStiffnessRule = StiffnessRule<R, Precision, S> &&
    requires(R const& rule, StiffnessFields<Precision, S> const& fields, int v) {
  { rule.vertex(fields, v) } -> std::same_as<double>;
};

struct GivenStiffness {
  static constexpr char const* name = "given";
  static constexpr bool per_vertex = false;
  double pressure = 0;  ///< P, Pa; to be given

  bool valid() const { return pressure > 0; }

  template <class Fields>
  KOKKOS_FUNCTION double operator()(Fields const& fields, PairKind kind, int const (&v)[4]) const {
    double const a[4] = {double(fields.area(v[0])), double(fields.area(v[1])),
                         double(fields.area(v[2])), double(fields.area(v[3]))};
    // The areas of the edges add up to that of the surface: a third of the mean of the ends'.
    double const area = kind == PairKind::point_triangle
                            ? Kokkos::min(a[0], (a[1] + a[2] + a[3]) / 3)
                            : Kokkos::min(a[0] + a[1], a[2] + a[3]) / 6;
    return 0.25 * pressure * area / fields.dhat;
  }
  template <class Fields>
  KOKKOS_FUNCTION double vertex(Fields const& fields, int v) const {
    return pressure * double(fields.area(v)) / fields.dhat;
  }
};

struct ElasticInclusiveStiffness {
  static constexpr char const* name = "elastic_inclusive";
  static constexpr bool per_vertex = true;
  double factor = 1;

  bool valid() const { return factor > 0; }

  /// What is fixed does not give way, so it is no measure.
  template <class Fields>
  KOKKOS_FUNCTION double operator()(Fields const& fields, PairKind, int const (&v)[4]) const {
    double sum = 0;
    int free = 0;
    for (int a = 0; a < 4; ++a) {
      if (fields.fixed(v[a])) continue;
      sum += double(fields.stiffness(v[a]));
      ++free;
    }
    return free > 0 ? factor * sum / free : 0;
  }
  template <class Fields>
  KOKKOS_FUNCTION double vertex(Fields const& fields, int v) const {
    return factor * double(fields.stiffness(v));
  }
};

}  // namespace taut
