#include <taut/core/fem/lattice.hpp>

namespace taut {
namespace {

/// Whether the cells in `mask` (bit 4x + 2y + z of a 2 x 2 x 2 block) hang together by faces.
bool face_connected(unsigned mask) {
  unsigned reached = mask & (0u - mask);
  for (unsigned last = 0; reached != last;) {
    last = reached;
    reached |= ((reached & 0xF0u) >> 4 | (reached & 0x0Fu) << 4 | (reached & 0xCCu) >> 2 |
                (reached & 0x33u) << 2 | (reached & 0xAAu) >> 1 | (reached & 0x55u) << 1) &
               mask;
  }
  return reached == mask;
}

}  // namespace

/// The boundary of a union of cells is a manifold when around every vertex both the filled and the
/// empty cells hang together by faces (well-composed sets: Latecki 1997).
void require_manifold(Lattice const& lattice) {
  auto const [nx, ny, nz] = lattice.size();
  for (int i = 0; i <= nx; ++i)
    for (int j = 0; j <= ny; ++j)
      for (int k = 0; k <= nz; ++k) {
        unsigned mask = 0;
        for (int b = 0; b < 8; ++b) {
          bool const filled =
              lattice.filled({i - 1 + (b >> 2), j - 1 + (b >> 1 & 1), k - 1 + (b & 1)});
          mask |= static_cast<unsigned>(filled) << b;
        }
        if (!face_connected(mask) || !face_connected(~mask & 0xFFu))
          throw Error(
              "boxes of the union touch in an edge or a vertex only, at lattice vertex ({}, {}, "
              "{}): "
              "let them share a face or keep them apart",
              i, j, k);
      }
}

}  // namespace taut
