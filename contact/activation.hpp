// From which distance on a pair is in contact. The barrier acts below the activation distance
//
//   a = min(dhat, f D),   D the distance of the pair at rest,
//
// for pairs of one body, and for pairs of two below dhat, or less where they start closer
// (start_activation.hpp). With f < 1 no pair acts at rest, so a body whose mesh is finer than dhat
// keeps its shape, and still no pair is exempt, as it would be by the exclusion of Shen et al. 2024
// (section 4.4: pairs closer than 1.5 dhat at rest are dropped; `RestExclusion`, for comparison). D
// is computed where it is needed, from the positions at rest: a table of all pairs would be as long
// as it is useless for most of them.
#pragma once

#include <taut/contact/candidates.hpp>
#include <taut/contact/surface.hpp>

namespace taut {

template <class S>
struct Activation {
  double dhat;                  ///< m
  double fraction = 0.5;        ///< f
  VectorField<double, S> rest;  ///< m
  typename SurfaceViews<S>::Indices object;
  /// What pairs of two bodies act below at most, per vertex of the mesh, m; empty: dhat.
  Array<double, S> of_vertex = {};

  KOKKOS_FUNCTION bool one_body(int const (&v)[4]) const { return object(v[0]) == object(v[3]); }

  /// The distance below which the pair of vertices v acts, m. It is zero, so that the pair never
  /// acts, if the two touch at rest.
  KOKKOS_FUNCTION double operator()(PairKind kind, int const (&v)[4]) const {
    if (!one_body(v)) return of_two(v);
    Vec3<double> y[4];
    gather(v, rest, y);
    return Kokkos::min(dhat, fraction * closest_points(kind, y).distance);
  }
  KOKKOS_FUNCTION double of_two(int const (&v)[4]) const {
    double least = dhat;
    if (of_vertex.extent(0) == 0) return least;
    for (int vertex : v) least = Kokkos::min(least, of_vertex(vertex));
    return least;
  }
};

/// A filter of candidates: keeps the pairs that are not closer at rest than `distance`, m (in the
/// paper 1.5 dhat). The set that it leaves out is exact.
template <class S>
struct RestExclusion {
  double distance;
  VectorField<double, S> rest;

  KOKKOS_FUNCTION bool operator()(PairKind kind, int const (&v)[4],
                                  Vec3<double> const (&)[4]) const {
    Vec3<double> y[4];
    gather(v, rest, y);
    return !(closest_points(kind, y).distance < distance);
  }
};

}  // namespace taut
