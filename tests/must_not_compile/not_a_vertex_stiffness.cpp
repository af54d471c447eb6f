// expect: taut: the stiffness of an Obstacle must satisfy VertexStiffnessRule
#include <taut/contact/obstacle.hpp>

using namespace taut;

/// Knows pairs, but no vertices.
struct OfPairsAlone {
  static constexpr char const* name = "of_pairs_alone";
  static constexpr bool per_vertex = false;
  bool valid() const { return true; }
  template <class Fields>
  KOKKOS_FUNCTION double operator()(Fields const&, PairKind, int const (&)[4]) const {
    return 1;
  }
};

using Refused = Obstacle<HalfSpace, Normalised<LogBarrier>, OfPairsAlone>::Params;
Refused refused;
