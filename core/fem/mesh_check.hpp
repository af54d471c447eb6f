// Judges a tetrahedral mesh before it is simulated: what cannot be simulated is refused by name,
// what can but may disappoint is a warning.
#pragma once

#include <cstdint>
#include <string>
#include <taut/core/fem/tet_mesh.hpp>
#include <vector>

namespace taut {

struct MeshReport {
  std::vector<std::string> warnings;  ///< one sentence each
  double volume = 0;                  ///< m^3
  double least_quality = 1;           ///< see mean_ratio
  std::int64_t flipped = 0;           ///< tets whose orientation was reversed
};

/// What to do with inverted tets in a mesh that also has positive ones. (If all are inverted, the
/// mesh only counts its vertices the other way round; it is flipped, with a warning.)
enum class Orientation { require, fix };

/// Throws Error for: no tets, vertex indices out of range, coordinates that are not finite, tets of
/// zero volume (|6V| <= 1e-12 of the cube of the longest edge), duplicate tets, isolated vertices
/// and, unless `orientation` is `fix`, inverted tets. Warns of slivers and of faces shared by more
/// than two tets. `name` is the mesh in messages; elements and vertices count from 0.
MeshReport check_mesh(TetMesh& mesh, std::string const& name,
                      Orientation orientation = Orientation::require);

/// Six times the signed volume, det[x1-x0 | x2-x0 | x3-x0].
double six_volume(TetMesh const& mesh, Tet const& tet);

/// Shape quality 12 (3|V|)^(2/3) / sum of squared edge lengths: 1 for the regular tet, 0 for a flat
/// one (Liu and Joe, "Relationship between tetrahedron shape measures", BIT 34, 1994). Below 0.05 a
/// tet is reported as a sliver.
double mean_ratio(TetMesh const& mesh, Tet const& tet);

}  // namespace taut
