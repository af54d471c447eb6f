// Patches: runs of neighbouring tets that one team of threads processes together, so that vertex
// data are read once per patch and forces are added up in fast memory.
//
// A sweep over a patch (1) copies the data of its vertices to local memory, (2) computes its
// elements, a pack of them at a time, and leaves what each corner receives in a slot, (3) adds up
// the slots of each local vertex in a fixed order. The sum of a vertex that no other patch has is
// added to the result; those of shared vertices go to rows of their own, and a second loop over
// the shared vertices adds up their rows, again in a fixed order. No atomics; the result depends
// neither on the number of threads nor on the size of a team.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/space.hpp>
#include <taut/core/fem/tet_mesh.hpp>
#include <taut/core/math/scalar.hpp>

#include <span>
#include <vector>

namespace taut {

/// The patches of a list of tets, on the host. A patch of n packs gives lane l of its pack k the
/// tet l n + k; where there is none, a copy of the last one, which has no weight and no incidence.
/// The corners of a tet take the places 3, 0, 1, 2: those that have a row of B come first.
struct Patches {
  int lanes = 1;                          ///< elements per pack
  std::vector<int> pack_begin;            ///< per patch, +1: its packs
  std::vector<int> local_begin;           ///< per patch, +1: its local vertices
  std::vector<int> material;              ///< per patch
  std::vector<int> body;                  ///< per patch: the smallest vertex of its body
  std::vector<int> vertex;                ///< per local vertex: vertex of the mesh
  std::vector<int> tet;                   ///< per element: index into the list
  std::vector<char> padding;              ///< per element: 1 for a padding copy
  std::vector<std::uint16_t> corner;      ///< [pack][place][lane]: 4 x local vertex in its patch
  std::vector<int> incidence_begin;       ///< per local vertex, +1
  std::vector<std::uint16_t> incidence;   ///< slot (pack within patch * 4 + place) * lanes + lane
  std::vector<int> occurrence_begin;      ///< per vertex of the mesh, +1
  std::vector<int> occurrence;            ///< its local vertices, ascending
  std::vector<int> shared;                ///< vertices that several patches have
  std::vector<int> shared_begin;          ///< per shared vertex, +1: its rows
  std::vector<int> row;                   ///< per local vertex: its row, or -1 if not shared
  std::vector<std::vector<int>> colours;  ///< patches that share no vertex, for assembly
  int max_locals = 0, max_packs = 0;

  int count() const { return static_cast<int>(material.size()); }
};

/// `tets` in locality-preserving order, with vertices below `vertices`; `material[t]` of each. A
/// patch holds up to `patch_size` tets of one material and one body (tets that are connected), so
/// that sweeps can leave a body out and sum up for each. Throws Error unless patch_size is 1 to
/// 4096.
Patches make_patches(std::span<Tet const> tets, std::span<int const> material, int vertices,
                     int lanes, int patch_size);

/// The patches where the kernels read them, with the rest shape of the elements.
template <class S, class Real>
struct PatchViews {
  template <class T>
  using Data =
      Kokkos::View<T const*, typename S::memory, Kokkos::MemoryTraits<Kokkos::RandomAccess>>;

  /// Elements per pack: one register on the host, one warp on a device.
  static constexpr int lanes = S::on_host ? host_lanes<Real> : 32;

  int count = 0, vertices = 0, shared_rows = 0, max_locals = 0, max_packs = 0;
  Data<int> pack_begin, local_begin, material, vertex, incidence_begin, shared, shared_begin, row;
  Data<std::uint16_t> corner, incidence;
  /// Per patch: not 0 while sweeps leave it out. The one thing here that changes.
  Kokkos::View<std::uint8_t*, typename S::memory> idle;
  /// [pack][10][lane]: the inverse rest shape B = Dm^-1 by columns, then the rest volume W.
  Data<Real> rest;
};

/// `rest` holds ten doubles per element of `patches` (B by columns, W).
template <class S, class Real>
PatchViews<S, Real> copy_patches(Patches const& patches, std::vector<double> const& rest) {
  PatchViews<S, Real> v;
  v.count = patches.count();
  v.vertices = static_cast<int>(patches.occurrence_begin.size()) - 1;
  v.shared_rows = patches.shared_begin.back();
  v.max_locals = patches.max_locals;
  v.max_packs = patches.max_packs;
  v.pack_begin = to_space<S>("patch_packs", patches.pack_begin);
  v.local_begin = to_space<S>("patch_locals", patches.local_begin);
  v.material = to_space<S>("patch_material", patches.material);
  v.vertex = to_space<S>("patch_vertex", patches.vertex);
  v.incidence_begin = to_space<S>("patch_incidence_begin", patches.incidence_begin);
  v.incidence = to_space<S>("patch_incidence", patches.incidence);
  v.shared = to_space<S>("patch_shared", patches.shared);
  v.shared_begin = to_space<S>("patch_shared_begin", patches.shared_begin);
  v.row = to_space<S>("patch_row", patches.row);
  v.corner = to_space<S>("patch_corner", patches.corner);
  std::vector<Real> packed(rest.size());
  constexpr std::size_t lanes = PatchViews<S, Real>::lanes;
  for (std::size_t e = 0; e < rest.size() / 10; ++e) {
    for (std::size_t k = 0; k < 10; ++k) {
      packed[(e / lanes * 10 + k) * lanes + e % lanes] = static_cast<Real>(rest[10 * e + k]);
    }
  }
  v.rest = to_space<S>("patch_rest", packed);
  v.idle = decltype(v.idle)("patch_idle", v.count);
  return v;
}

}  // namespace taut
