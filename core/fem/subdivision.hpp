// Finer versions of a tet mesh: every edge is cut into n pieces and every tet into n^3.
//
// Edgewise subdivision (Edelsbrunner and Grayson 2000, "Edgewise subdivision of a simplex"): the
// vertices of a tet in ascending order span the simplex n >= i >= j >= k >= 0, and the unit cubes
// in it are cut into six along their main diagonal (Freudenthal, Kuhn). The children have at most
// three shapes whatever n is, their volume is that of the tet over n^3, and since the order of
// vertices is that of the whole mesh, neighbours agree on their common face.
#pragma once

#include <taut/core/fem/tet_mesh.hpp>

namespace taut {

/// The vertices of the mesh come first and keep their numbers; the orientation of a tet is that of
/// its children. Throws Error for n below 1, more than 2^27 tets, or a tet that names a vertex
/// that is not there.
TetMesh split_edges(TetMesh const& mesh, int n);

}  // namespace taut
