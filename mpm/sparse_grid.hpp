// The grid of a material point method: exists where particles are. It is rebuilt from the lowest
// nodes that the kernels of the particles reach: where kernels run, every particle sets the bit of
// its lowest node in the leaf that holds it; the host, which sees leaves only, adds those that are
// new, and makes the set of all nodes reached (topology.hpp). Bits are set in any order, and
// numbers follow from the set: the grid is bitwise the same whatever the order of the particles and
// the number of threads.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/scan.hpp>
#include <taut/mpm/grid_level.hpp>

#include <set>

namespace taut {
namespace kernels {

template <class S>
using BaseNodes = Kokkos::View<int const* [3], typename S::layout, typename S::memory>;

/// The first particle beyond the farthest place of a grid.
template <class S>
struct FindFarParticle {
  BaseNodes<S> base;
  KOKKOS_FUNCTION void operator()(int p, int& first) const {
    for (int c = 0; c < 3; ++c) {
      int const i = base(p, c);
      if (i < -Topology::farthest || i > Topology::farthest) first = Kokkos::min(first, p);
    }
  }
};

template <class S>
struct MarkBases {
  BaseNodes<S> base;
  LeafTable<S> leaves;
  typename GridNodes<S>::template PerLeaf<std::uint64_t* [8]> mask;
  /// Raises `missing` where a leaf is not there.
  KOKKOS_FUNCTION void operator()(int p, int& missing) const {
    int const i = base(p, 0), j = base(p, 1), k = base(p, 2), l = leaves.find(i, j, k);
    if (l < 0) {
      missing = 1;
      return;
    }
    std::uint64_t const bit = std::uint64_t(1) << (8 * (j & 7) + (k & 7));
    std::uint64_t* const word = &mask(l, i & 7);
    if ((Kokkos::atomic_load(word) & bit) == 0) Kokkos::atomic_or(word, bit);
  }
};

/// 1 for a particle in a leaf that is not there, unless that before it is in the same.
template <class S>
struct IsMissing {
  BaseNodes<S> base;
  LeafTable<S> leaves;
  KOKKOS_FUNCTION int operator()(int p) const {
    if (leaves.find(base(p, 0), base(p, 1), base(p, 2)) >= 0) return 0;
    if (p == 0) return 1;
    int differ = 0;
    for (int c = 0; c < 3; ++c) differ |= (base(p, c) ^ base(p - 1, c)) & ~7;
    return differ != 0;
  }
};

template <class S>
struct ListMissing {
  IsMissing<S> is_missing;
  Kokkos::View<int*, typename S::memory> place;
  Kokkos::View<int* [3], Kokkos::LayoutRight, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int p) const {
    if (is_missing(p) == 0) return;
    for (int c = 0; c < 3; ++c) to(place(p), c) = is_missing.base(p, c) & ~7;
  }
};

}  // namespace kernels

template <class S = DefaultSpace>
class SparseGrid {
public:
  using BaseNodes = Kokkos::View<int const* [3], typename S::layout, typename S::memory>;

  /// The grid of `count` particles whose kernels are `width` nodes wide per axis (2 linear, 3
  /// quadratic, 4 cubic) and begin at node `base(p)`; `dx` is the spacing, m. Throws Error where a
  /// base is farther from the origin than an int can count with room for sums.
  void rebuild(BaseNodes const& base, int count, int width, double dx) {
    if (width < 2 || width > 4 || !(dx > 0) || !std::isfinite(dx)) {
      throw Error(
          "sparse grid: kernels of {} nodes and a spacing of {} m; choose 2 to 4 nodes and "
          "a positive spacing",
          width, dx);
    }
    if (base.extent(0) < static_cast<std::size_t>(count)) {
      throw Error("sparse grid: {} particles, but {} base nodes", count, base.extent(0));
    }
    int const far = minimum<S>("far_particle", count, count, kernels::FindFarParticle<S>{base});
    if (far < count) {
      throw Error(
          "sparse grid: particle {} is more than {} nodes of {} m from the origin; it has flown "
          "off, or the spacing is too small for where the scene is",
          far, Topology::farthest, dx);
    }
    mark(base, count);
    level_.reach(bases_, width, dx);
  }

  GridNodes<S> const& nodes() const { return level_.nodes(); }
  LeafList const& leaves() const { return level_.leaves(); }

private:
  /// Sets the bits of the particles, and lists the leaves of `base_leaves_` that have any.
  void mark(BaseNodes const& base, int count) {
    while (true) {
      std::size_t const n = base_origins_.size();
      grow(mask_, host_mask_, "base_mask", n);
      clear_masks(n);
      kernels::MarkBases<S> const mark{base, base_leaves_.table(), mask_};
      if (maximum<S>("mark_bases", count, 0, mark) == 0) break;
      add_missing(base, count);
    }
    list_bases();
  }

  void clear_masks(std::size_t n) {
    if (n == 0) return;
    auto const range = Kokkos::make_pair(std::size_t(0), n);
    assign_on<S>(Kokkos::subview(mask_, range, Kokkos::ALL), std::uint64_t(0));
  }

  /// Leaves that particles are in and that are not known yet.
  void add_missing(BaseNodes const& base, int count) {
    kernels::IsMissing<S> const is_missing{base, base_leaves_.table()};
    grow(place_, "missing_place", count);
    int const found = exclusive_scan<S, int>("missing_leaves", count, is_missing, place_);
    grow(missing_, host_missing_, "missing", found);
    for_each<S>("list_missing", count, kernels::ListMissing<S>{is_missing, place_, missing_});
    S::instance().fence("taut: missing leaves");
    copy_front<S>(missing_, host_missing_, found);
    std::set<std::array<int, 3>> added;
    for (int m = 0; m < found; ++m) {
      added.insert({host_missing_(m, 0), host_missing_(m, 1), host_missing_(m, 2)});
    }
    base_origins_.insert(base_origins_.end(), added.begin(), added.end());
    base_leaves_.assign(base_origins_);
  }

  void list_bases() {
    std::size_t const n = base_origins_.size();
    S::instance().fence("taut: base nodes");
    copy_front<S>(mask_, host_mask_, n);
    bases_.clear();
    for (std::size_t l = 0; l < n; ++l) {
      LeafMask mask;
      std::uint64_t any = 0;
      for (int x = 0; x < 8; ++x) any |= mask[x] = host_mask_(l, x);
      if (any == 0) continue;
      bases_.origin.push_back(base_origins_[l]);
      bases_.mask.push_back(mask);
    }
    // Leaves that particles have left stay until most are such.
    if (2 * static_cast<std::size_t>(bases_.size()) < n) {
      base_origins_ = bases_.origin;
      base_leaves_.assign(base_origins_);
    }
  }

  std::vector<std::array<int, 3>> base_origins_;
  LeafIndex<S> base_leaves_;
  LeafList bases_;
  typename GridNodes<S>::template PerLeaf<std::uint64_t* [8]> mask_;
  typename decltype(mask_)::HostMirror host_mask_;
  Kokkos::View<int*, typename S::memory> place_;
  Kokkos::View<int* [3], Kokkos::LayoutRight, typename S::memory> missing_;
  typename decltype(missing_)::HostMirror host_missing_;
  GridLevel<S> level_;
};

}  // namespace taut
