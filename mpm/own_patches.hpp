// The patches of some of the materials, numbered from 0, as a term over particles sweeps them that
// knows these materials and no others: what each model of a scene of several has. Slots, blocks and
// nodes are those of all patches, so what terms write for their particles stands side by side.
#pragma once

#include <taut/mpm/material_range.hpp>
#include <taut/mpm/particle_blocks.hpp>

namespace taut {

namespace kernels {

template <Spline K, class S>
struct OwnPatch {
  BlockViews<K, S> all;
  MaterialRange materials;
  KOKKOS_FUNCTION int operator()(int patch) const { return materials.holds(all.material(patch)); }
};
template <Spline K, class S>
struct OwnRow {
  OwnPatch<K, S> patches;
  KOKKOS_FUNCTION int operator()(int r) const {
    return patches(patches.all.row(r) / BlockViews<K, S>::nodes);
  }
};

/// How many there are of the first entries of a list.
template <class S>
struct OwnBefore {
  Kokkos::View<int const*, typename S::memory> scan;
  int count, total;
  KOKKOS_FUNCTION int operator()(int k) const { return k < count ? scan(k) : total; }
};

template <Spline K, class S>
struct TakeOwnPatch {
  OwnPatch<K, S> own;
  OwnBefore<S> before;
  BlockViews<K, S> to;
  KOKKOS_FUNCTION void operator()(int patch) const {
    if (!own(patch)) return;
    int const k = before(patch);
    to.slot_begin(k) = own.all.slot_begin(patch);
    to.slot_end(k) = own.all.slot_end(patch);
    to.count(k) = own.all.count(patch);
    to.material(k) = own.all.material(patch) - own.materials.first;
    to.block(k) = own.all.block(patch);
    to.heart(k) = own.all.heart(patch);
  }
};
template <Spline K, class S>
struct TakeOwnRow {
  OwnRow<K, S> own;
  OwnBefore<S> patches_before, rows_before;
  Kokkos::View<int*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int r) const {
    if (!own(r)) return;
    constexpr int nodes = BlockViews<K, S>::nodes;
    int const row = own.patches.all.row(r);
    to(rows_before(r)) = patches_before(row / nodes) * nodes + row % nodes;
  }
};
/// Where what there is of a list begins, from where it did.
template <class S>
struct BeginOwn {
  Kokkos::View<int const*, typename S::memory> begin;
  OwnBefore<S> before;
  Kokkos::View<int*, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int k) const { to(k) = before(begin(k)); }
};

}  // namespace kernels

template <Spline K, class S = DefaultSpace>
class OwnPatches {
public:
  using Views = BlockViews<K, S>;

  /// Of `all`, which are bound to a grid of `nodes` nodes, the patches of these materials, counted
  /// from `first`. Reads on in both until the next call.
  Views const& select(Views const& all, MaterialRange const& materials, int nodes) {
    own_ = all;
    if (materials.first == 0 && materials.end >= all.materials) return own_;
    own_.materials = materials.end - materials.first;
    int const rows = all.patches * Views::nodes;
    grow(patch_scan_, "own_patches_before", all.patches);
    grow(row_scan_, "own_rows_before", rows);
    kernels::OwnPatch<K, S> const own{all, materials};
    kernels::OwnRow<K, S> const own_row{own};
    int const patches = exclusive_scan<S, int>("own_patches_before", all.patches, own, patch_scan_);
    int const total = exclusive_scan<S, int>("own_rows_before", rows, own_row, row_scan_);
    kernels::OwnBefore<S> const patches_before{patch_scan_, all.patches, patches},
        rows_before{row_scan_, rows, total};

    own_.patches = patches;
    own_.slot_begin = provide(memory_[0], "own_slot_begin", patches);
    own_.slot_end = provide(memory_[1], "own_slot_end", patches);
    own_.count = provide(memory_[2], "own_patch_count", patches);
    own_.material = provide(memory_[3], "own_patch_material", patches);
    own_.block = provide(memory_[4], "own_patch_block", patches);
    own_.heart = provide(memory_[5], "own_patch_heart", patches);
    own_.patch_begin = provide(memory_[6], "own_patch_begin", all.blocks + 1);
    own_.row = provide(memory_[7], "own_node_row", total);
    own_.row_begin = provide(memory_[8], "own_row_begin", nodes + 1);
    for_each<S>("own_patches", all.patches, kernels::TakeOwnPatch<K, S>{own, patches_before, own_});
    for_each<S>("own_blocks", all.blocks + 1,
                kernels::BeginOwn<S>{all.patch_begin, patches_before, own_.patch_begin});
    for_each<S>("own_rows", rows,
                kernels::TakeOwnRow<K, S>{own_row, patches_before, rows_before, own_.row});
    for_each<S>("own_nodes", nodes + 1,
                kernels::BeginOwn<S>{all.row_begin, rows_before, own_.row_begin});
    return own_;
  }

private:
  using List = Kokkos::View<int*, typename S::memory>;
  static List const& provide(List& memory, char const* name, int count) {
    grow(memory, name, std::size_t(count));
    return memory;
  }

  Views own_;
  List patch_scan_, row_scan_, memory_[9];
};

}  // namespace taut
