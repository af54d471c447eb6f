// Locality-preserving order of a mesh: tets along a Hilbert curve through their centroids, vertices
// by first use. The solver works in this order; results go back through the permutation, so that a
// user never sees it.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

#include <span>

namespace taut {

struct Ordering {
  std::vector<std::int32_t> tets;        ///< tets[new] = old
  std::vector<std::int32_t> vertices;    ///< vertices[new] = old; vertices without a tet come last
  std::vector<std::int32_t> new_vertex;  ///< new_vertex[old] = new
};

/// `group[t]` (may be empty) is the part that tet t belongs to: tets of a part stay together, in
/// ascending order of the part, and within it those of one body (tets that are connected).
Ordering locality_order(TetMesh const& mesh, std::span<std::int32_t const> group = {});

}  // namespace taut
