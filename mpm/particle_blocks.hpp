// Particles in the order in which sweeps meet them: by block of 4^3 cells, one patch for each
// material that a block holds.
//
// The cell of a particle is named by the lowest node that the particle sees (spline.hpp). What
// particles of a block see fits into a cube of 4 + width - 1 nodes along each axis, which a team
// keeps in fast memory while it works on a patch, as it does with the vertices of a patch of tets
// (core/fem/patches.hpp).
//
// Within a patch particles stand in rounds: the first of every cell, then the second of every cell
// that has two, and so on. The particles of a round are in different cells, so at one place of the
// stencil they add to different nodes: threads (and the lanes of a register) do not meet, nothing
// is atomic, and each node receives its sum in an order that depends on the particles alone. Sums
// of a patch go to rows of its own, which are added up per node, again in a fixed order.
//
// Sorted anew each step; memory grows and is kept.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/growing.hpp>
#include <taut/core/exec/sort.hpp>
#include <taut/core/math/matrix.hpp>
#include <taut/core/math/scalar.hpp>
#include <taut/mpm/grid_nodes.hpp>
#include <taut/mpm/spline.hpp>

#include <bit>

namespace taut {

/// The blocks as kernels see them.
template <Spline K, class S>
struct BlockViews {
  template <class T>
  using List = Kokkos::View<T*, typename S::memory>;

  static constexpr int cells = 4;                    ///< of a block, along an axis
  static constexpr int side = cells + K::width - 1;  ///< nodes that they see
  static constexpr int nodes = side * side * side;   ///< of which number i, j, k is
  KOKKOS_FORCEINLINE_FUNCTION static constexpr int local(int i, int j, int k) {
    return (i * side + j) * side + k;
  }
  /// Particles of a patch are padded to a multiple of this, the widest pack of any scalar: what is
  /// computed in double may be kept for packs of floats.
  static constexpr int lanes = S::on_host ? host_lanes<float> : 32;

  int patches = 0, blocks = 0, materials = 0;
  int slots = 0;               ///< places for particles, padding included
  List<int> particle;          ///< per slot; -1: padding
  List<std::uint16_t> corner;  ///< per slot: 4 x the lowest local node that it sees
  List<int> slot_begin;        ///< per patch; a multiple of `lanes`
  List<int> slot_end;          ///< per patch: where its padding ends
  List<int> count;             ///< per patch: slots that hold particles, the first ones
  List<int> round_end;         ///< at slot_begin(patch) + r: where round r ends in the patch
  List<int> material;          ///< per patch
  List<int> block;             ///< per patch
  /// Per patch: the local node in the middle of what the fullest cell sees, so of what many
  /// particles see much. It certainly is a node of the grid.
  List<int> heart;
  List<int> patch_begin;  ///< per block, +1
  Kokkos::View<int* [3], typename S::layout, typename S::memory>
      origin;  ///< per block: its lowest node
  Kokkos::View<int* [3], typename S::layout, typename S::memory>
      cell;                  ///< per particle: the lowest node that it sees
  List<int> node;            ///< per block and local node: number in the grid, or -1
  List<int> row_begin, row;  ///< per node of the grid: its rows, patch * nodes + local

  /// The particle of a slot. What fills a pack up is like the first particle of it, no matter what
  /// it weighs: anywhere else a node that hardly any particle sees could invert it, and no volume
  /// times no number is no number.
  KOKKOS_FORCEINLINE_FUNCTION int like(int slot) const {
    int const p = particle(slot);
    return p >= 0 ? p : particle(slot / lanes * lanes);
  }
  KOKKOS_FORCEINLINE_FUNCTION int const* nodes_of(int patch) const {
    return node.data() + std::size_t(nodes) * block(patch);
  }
};

/// How so many numbers of each particle lie in memory: [pack][number][lane], so that sweeps read a
/// pack of particles at a time.
template <class S, class T, int numbers>
struct SlotLayout {
  /// Particles side by side: a register on the host, a warp on a device.
  static constexpr int lanes = S::on_host ? host_lanes<T> : 32;

  /// Where number k of the particle in a slot is.
  KOKKOS_FORCEINLINE_FUNCTION static std::size_t place(int slot, int k = 0) {
    return (std::size_t(slot / lanes) * numbers + k) * lanes + slot % lanes;
  }
};

namespace kernels {

/// How a key is put together, from the highest bits: leaf (8^3 cells) x, y, z; block in the leaf;
/// material; cell in the block.
struct CellKey {
  int lowest[3];  ///< leaf
  int bits[3];    ///< of the leaf's coordinates
  int material_bits;

  KOKKOS_FUNCTION std::uint64_t operator()(int const (&cell)[3], int material) const {
    std::uint64_t key = 0;
    for (int c = 0; c < 3; ++c) {
      key = key << bits[c] | static_cast<std::uint64_t>((cell[c] >> 3) - lowest[c]);
    }
    for (int c = 0; c < 3; ++c) key = key << 1 | static_cast<std::uint64_t>(cell[c] >> 2 & 1);
    key = key << material_bits | static_cast<std::uint64_t>(material);
    for (int c = 0; c < 3; ++c) key = key << 2 | static_cast<std::uint64_t>(cell[c] & 3);
    return key;
  }
  KOKKOS_FUNCTION std::uint64_t patch(std::uint64_t key) const { return key >> 6; }
  KOKKOS_FUNCTION std::uint64_t block(std::uint64_t key) const {
    return key >> (6 + material_bits);
  }
  KOKKOS_FUNCTION int material(std::uint64_t key) const {
    return static_cast<int>(key >> 6 & ((std::uint64_t(1) << material_bits) - 1));
  }
  KOKKOS_FUNCTION static void cell_in_block(std::uint64_t key, int (&cell)[3]) {
    for (int c = 0; c < 3; ++c) cell[c] = static_cast<int>(key >> (4 - 2 * c) & 3);
  }
  KOKKOS_FUNCTION void block_origin(std::uint64_t key, int (&node)[3]) const {
    std::uint64_t const sub = block(key);
    std::uint64_t leaf = sub >> 3;
    for (int c = 2; c >= 0; --c) {
      int const from_lowest = static_cast<int>(leaf & ((std::uint64_t(1) << bits[c]) - 1));
      leaf >>= bits[c];
      node[c] = (lowest[c] + from_lowest) * 8 + static_cast<int>(sub >> (2 - c) & 1) * 4;
    }
  }
};

/// The cell of each particle; lowers `bad` to the first that has none.
template <Spline K, class S, class Positions>
struct FindCells {
  Positions x;
  double per_length;
  int farthest;
  Kokkos::View<int* [3], typename S::layout, typename S::memory> cell;

  KOKKOS_FUNCTION void operator()(int p, int& bad) const {
    for (int c = 0; c < 3; ++c) {
      double const base = base_node<K>(double(x(p, c)) * per_length);
      bool const good = Kokkos::abs(base) < farthest;
      if (!good) bad = Kokkos::min(bad, p);
      cell(p, c) = good ? static_cast<int>(base) : 0;
    }
  }
};

template <class S>
struct LowestLeaf {
  Kokkos::View<int* [3], typename S::layout, typename S::memory> cell;
  int axis, sign;
  KOKKOS_FUNCTION void operator()(int p, int& lowest) const {
    lowest = Kokkos::min(lowest, sign * (cell(p, axis) >> 3));
  }
};

template <class S>
struct WrongMaterial {
  Kokkos::View<int const*, typename S::memory> material;
  int materials;
  KOKKOS_FUNCTION void operator()(int p, int& first) const {
    if (material(p) < 0 || material(p) >= materials) first = Kokkos::min(first, p);
  }
};

template <class S>
struct MakeKeys {
  CellKey make;
  Kokkos::View<int* [3], typename S::layout, typename S::memory> cell;
  Kokkos::View<int const*, typename S::memory> material;
  Kokkos::View<std::uint64_t*, typename S::memory> key;
  KOKKOS_FUNCTION void operator()(int p) const {
    int const at[3] = {cell(p, 0), cell(p, 1), cell(p, 2)};
    key(p) = make(at, material(p));
  }
};

/// 1 where the sorted keys, less their lowest bits, change.
template <class S>
struct KeyChanges {
  Kokkos::View<std::uint64_t const*, typename S::memory> key;
  int shift;
  KOKKOS_FUNCTION int operator()(int k) const {
    return k == 0 || key(k) >> shift != key(k - 1) >> shift;
  }
};

template <Spline K, class S>
struct BeginPatches {
  CellKey make;
  KeyChanges<S> patch_changes, block_changes, cell_changes;
  Kokkos::View<int const*, typename S::memory> patches_before, blocks_before, cells_before;
  Kokkos::View<int*, typename S::memory> first;  ///< per patch: sorted particle
  BlockViews<K, S> to;
  Kokkos::View<int* [3], typename S::layout, typename S::memory> base;  ///< per cell
  KOKKOS_FUNCTION void operator()(int k) const {
    std::uint64_t const key = patch_changes.key(k);
    if (cell_changes(k)) {
      int block[3], cell[3];
      make.block_origin(key, block);
      make.cell_in_block(key, cell);
      for (int c = 0; c < 3; ++c) base(cells_before(k), c) = block[c] + cell[c];
    }
    if (!patch_changes(k)) return;
    int const patch = patches_before(k);
    int const block = blocks_before(k) + block_changes(k) - 1;
    first(patch) = k;
    to.material(patch) = make.material(key);
    to.block(patch) = block;
    if (!block_changes(k)) return;
    to.patch_begin(block) = patch;
    int origin[3];
    make.block_origin(key, origin);
    for (int c = 0; c < 3; ++c) to.origin(block, c) = origin[c];
  }
};

template <class S>
struct PaddedCount {
  Kokkos::View<int const*, typename S::memory> first;
  int patches, particles, lanes;
  KOKKOS_FUNCTION int count(int patch) const {
    return (patch + 1 < patches ? first(patch + 1) : particles) - first(patch);
  }
  KOKKOS_FUNCTION int operator()(int patch) const {
    return (count(patch) + lanes - 1) / lanes * lanes;
  }
};

/// Puts the particles of a patch into rounds.
template <Spline K, class S>
struct FillPatch {
  Kokkos::View<std::uint64_t const*, typename S::memory> key;
  Kokkos::View<int const*, typename S::memory> order;
  PaddedCount<S> counts;
  BlockViews<K, S> to;

  KOKKOS_FUNCTION void operator()(int patch) const {
    constexpr int cells = 64, middle = K::width / 2;
    int begin[cells], end[cells];
    for (int c = 0; c < cells; ++c) begin[c] = end[c] = 0;
    int const first = counts.first(patch), count = counts.count(patch);
    for (int k = first; k < first + count; ++k) {
      int const c = static_cast<int>(key(k) & (cells - 1));
      if (end[c] == 0) begin[c] = k;
      end[c] = k + 1;
    }
    int fullest = 0;
    for (int c = 1; c < cells; ++c) {
      if (end[c] - begin[c] > end[fullest] - begin[fullest]) fullest = c;
    }
    to.heart(patch) = local(fullest) + BlockViews<K, S>::local(middle, middle, middle);
    int const slots = to.slot_begin(patch);
    int slot = 0;
    for (int round = 0; slot < count; ++round) {
      for (int c = 0; c < cells; ++c) {
        if (begin[c] + round >= end[c]) continue;
        to.particle(slots + slot) = order(begin[c] + round);
        to.corner(slots + slot) = static_cast<std::uint16_t>(4 * local(c));
        ++slot;
      }
      to.round_end(slots + round) = slot;
    }
    to.count(patch) = count;
    for (int k = count; k < counts(patch); ++k) {
      to.particle(slots + k) = -1;
      to.corner(slots + k) = to.corner(slots + k / counts.lanes * counts.lanes);
    }
  }

private:
  /// The lowest local node that a cell of the block sees.
  KOKKOS_FORCEINLINE_FUNCTION static int local(int cell) {
    return BlockViews<K, S>::local(cell >> 4, cell >> 2 & 3, cell & 3);
  }
};

template <Spline K, class S>
struct FindNodes {
  GridNodes<S> grid;
  BlockViews<K, S> blocks;
  KOKKOS_FUNCTION void operator()(int n) const {
    constexpr int side = BlockViews<K, S>::side, nodes = BlockViews<K, S>::nodes;
    int const block = n / nodes, l = n % nodes;
    blocks.node(n) =
        grid.node(blocks.origin(block, 0) + l / (side * side),
                  blocks.origin(block, 1) + l / side % side, blocks.origin(block, 2) + l % side);
  }
};

template <Spline K, class S>
struct NodeOfRow {
  BlockViews<K, S> blocks;
  Kokkos::View<int*, typename S::memory> bucket;
  int nodes;
  KOKKOS_FUNCTION void operator()(int row) const {
    constexpr int locals = BlockViews<K, S>::nodes;
    int const node = blocks.nodes_of(row / locals)[row % locals];
    bucket(row) = node >= 0 ? node : nodes;
  }
};

}  // namespace kernels

template <Spline K, class Space_ = DefaultSpace>
class ParticleBlocks {
public:
  using Space = Space_;
  using Views = BlockViews<K, Space>;
  template <class T>
  using List = Kokkos::View<T*, typename Space::memory>;
  using Cells = Kokkos::View<int* [3], typename Space::layout, typename Space::memory>;

  /// Cells may be this far from the origin, in either direction.
  static constexpr int farthest = (1 << 29) - 64;

  /// Sorts the first `count` particles at x (m) on a grid of spacing dx (m); `material` is in [0,
  /// materials). Throws Error for a particle that is nowhere, or whose material does not exist.
  template <class Positions>
  void sort(Positions const& x, List<int const> const& material, int count, int materials,
            double dx);

  /// The lowest nodes of the cells that hold particles (a cell of several materials comes more than
  /// once), the first cell_count() entries: what the grid is made of.
  Cells const& cells() const { return base_; }
  int cell_count() const { return cell_count_; }

  /// Says which node of the grid is where. The grid must have all nodes that the cells see.
  void bind(GridNodes<Space> const& grid);

  Views const& views() const { return views_; }

private:
  Views views_;
  int cell_count_ = 0;
  Cells cell_, base_;
  List<std::uint64_t> key_;
  List<int> order_, patches_before_, blocks_before_, cells_before_, first_, bucket_;
  StableSort<Space, std::uint64_t> sort_;
  BucketSort<Space> rows_;
  int sort_capacity_ = 0, row_capacity_ = 0;
};

template <Spline K, class S>
template <class Positions>
void ParticleBlocks<K, S>::sort(Positions const& x, List<int const> const& material, int count,
                                int materials, double dx) {
  if (!(dx > 0)) throw Error("particles: a grid of spacing {} m; give one above 0", dx);
  grow(cell_, "particle_cell", count);
  grow(key_, "particle_key", count);
  grow(order_, "particle_order", count);
  grow(patches_before_, "patches_before", count);
  grow(blocks_before_, "blocks_before", count);
  grow(cells_before_, "cells_before", count);
  if (sort_capacity_ < count) {
    sort_capacity_ = count + count / 4;
    sort_ = StableSort<S, std::uint64_t>(sort_capacity_);
  }
  int const bad = minimum<S>("find_cells", count, count,
                             kernels::FindCells<K, S, Positions>{x, 1 / dx, farthest, cell_});
  if (bad < count) {
    throw Error(
        "particle {} is nowhere: its place is not finite, or more than {} cells of {} m from the "
        "origin; take smaller steps",
        bad, farthest, dx);
  }
  int const wrong =
      minimum<S>("check_materials", count, count, kernels::WrongMaterial<S>{material, materials});
  if (wrong < count) {
    throw Error("particle {} is of a material that is not one of the {}", wrong, materials);
  }
  kernels::CellKey make{};
  make.material_bits = std::bit_width(static_cast<unsigned>(materials > 0 ? materials - 1 : 0));
  int total_bits = 9 + make.material_bits;
  for (int c = 0; c < 3 && count > 0; ++c) {
    using Lowest = kernels::LowestLeaf<S>;
    constexpr int most = Kokkos::Experimental::finite_max_v<int>;
    make.lowest[c] = minimum<S>("lowest_leaf", count, most, Lowest{cell_, c, 1});
    int const highest = -minimum<S>("highest_leaf", count, most, Lowest{cell_, c, -1});
    make.bits[c] = std::bit_width(static_cast<unsigned>(highest - make.lowest[c]));
    total_bits += make.bits[c];
  }
  if (total_bits > 64) {
    throw Error(
        "the particles are spread over 2^{} x 2^{} x 2^{} blocks of 8 cells, more than a key of 64 "
        "bits can name: use a coarser grid, or remove those that have left",
        make.bits[0], make.bits[1], make.bits[2]);
  }
  for_each<S>("particle_keys", count, kernels::MakeKeys<S>{make, cell_, material, key_});
  sort_.sort(count, key_, order_);

  using Changes = kernels::KeyChanges<S>;
  Changes const patch_changes{key_, 6}, block_changes{key_, 6 + make.material_bits},
      cell_changes{key_, 0};
  int const patches =
      exclusive_scan<S, int>("patches_before", count, patch_changes, patches_before_);
  int const blocks = exclusive_scan<S, int>("blocks_before", count, block_changes, blocks_before_);
  cell_count_ = exclusive_scan<S, int>("cells_before", count, cell_changes, cells_before_);
  views_.cell = cell_;
  views_.patches = patches;
  views_.blocks = blocks;
  views_.materials = materials;
  grow(base_, "cells", cell_count_);
  grow(first_, "patch_first", patches);
  grow(views_.material, "patch_material", patches);
  grow(views_.block, "patch_block", patches);
  grow(views_.heart, "patch_heart", patches);
  grow(views_.count, "patch_count", patches);
  grow(views_.slot_begin, "slot_begin", patches + 1);
  grow(views_.patch_begin, "patch_begin", blocks + 1);
  grow(views_.origin, "block_origin", blocks);
  for_each<S>(
      "begin_patches", count,
      kernels::BeginPatches<K, S>{make, patch_changes, block_changes, cell_changes, patches_before_,
                                  blocks_before_, cells_before_, first_, views_, base_});
  kernels::PaddedCount<S> const counts{first_, patches, count, Views::lanes};
  views_.slots = exclusive_scan<S, int>("slot_begin", patches, counts, views_.slot_begin);
  using Part = Kokkos::pair<int, int>;
  assign_on<S>(Kokkos::subview(views_.slot_begin, Part(patches, patches + 1)), views_.slots);
  assign_on<S>(Kokkos::subview(views_.patch_begin, Part(blocks, blocks + 1)), patches);
  views_.slot_end = Kokkos::subview(views_.slot_begin, Part(1, patches + 1));
  grow(views_.particle, "slot_particle", views_.slots);
  grow(views_.corner, "slot_corner", views_.slots);
  grow(views_.round_end, "round_end", views_.slots);
  for_each<S>("fill_patches", patches, kernels::FillPatch<K, S>{key_, order_, counts, views_});
}

template <Spline K, class S>
void ParticleBlocks<K, S>::bind(GridNodes<S> const& grid) {
  if (std::int64_t(views_.patches) * Views::nodes > Kokkos::Experimental::finite_max_v<int>) {
    throw Error("{} patches of particles are too many for this grid: use a coarser one",
                views_.patches);
  }
  int const table = views_.blocks * Views::nodes, rows = views_.patches * Views::nodes;
  grow(views_.node, "block_node", table);
  for_each<S>("find_nodes", table, kernels::FindNodes<K, S>{grid, views_});
  grow(bucket_, "row_bucket", rows);
  grow(views_.row, "node_row", rows);
  grow(views_.row_begin, "node_row_begin", grid.count + 2);
  if (row_capacity_ < rows) {
    row_capacity_ = rows + rows / 4;
    rows_ = BucketSort<S>(row_capacity_);
  }
  for_each<S>("node_of_row", rows, kernels::NodeOfRow<K, S>{views_, bucket_, grid.count});
  rows_.sort(rows, bucket_, grid.count + 1, views_.row_begin, views_.row);
}

}  // namespace taut
