// What makes a cycle slow where stiff meets soft, and at the surface, is not the coarse space but
// small cut cells: nodes that touch stiff particles with tiny weights, whose stiffness is far below
// that of the nodes around them. The 27 nodes around each such node are solved with exactly, in the
// place of single nodes:
//
//   M = W (Sum_c R_c' (R_c A R_c')^-1 R_c) W + (D^-1 where no patch is),
//
// with W = 1 / sqrt(number of patches that hold the node). Measured with M in the place of D^-1 in
// Chebyshev's smoother, on a bar of 12^3 cells with a stiff middle: CG takes 14 and 20 iterations
// instead of 69 and 128 at jumps of 1e4 and 1e6. But a patch costs as much as some hundred nodes,
// and where the body is a few cells thick patches overlap so much that they are in each other's
// way (bar_sweep: 38 iterations instead of 8). So they are to be asked for.
//
// The rows of A that patches need are assembled from the particles, no others.
#pragma once

#include <taut/core/exec/scan.hpp>
#include <taut/core/sparse/aggregate_inverse.hpp>
#include <taut/mpm/exact_block.hpp>

namespace taut {

struct CutCells {
  /// A node is cut where tr D is less than this times the largest of its 26 neighbours (1e-2
  /// serves); 0: none is.
  double ratio = 0;
};

namespace kernels {

/// Neighbour k of 27 of a node, or -1.
template <class S>
KOKKOS_FORCEINLINE_FUNCTION int neighbour(GridNodes<S> const& nodes, int i, int k) {
  return nodes.beside(i, k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1);
}

/// 1 where a free node is cut.
template <class S, class T>
struct IsCut {
  GridNodes<S> nodes;
  FixedNodes<S> fixed;
  BlockField<T, S> diagonal;
  double ratio;
  KOKKOS_FUNCTION double trace(int i) const {
    return double(diagonal(i, 0)) + double(diagonal(i, 1)) + double(diagonal(i, 2));
  }
  KOKKOS_FUNCTION int operator()(int i) const {
    if (is_fixed<S>(fixed, i)) return 0;
    double most = 0;
    for (int k = 0; k < 27; ++k) {
      int const j = neighbour(nodes, i, k);
      if (j >= 0 && !is_fixed<S>(fixed, j)) most = Kokkos::max(most, trace(j));
    }
    return trace(i) < ratio * most;
  }
};

/// The number of the patch around a node, or -1, in the place of the number of those before it.
template <class S, class T>
struct NumberPatches {
  IsCut<S, T> is_cut;
  NodeIndices<S> patch;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (is_cut(i) == 0) patch(i) = -1;
  }
};

/// The free nodes of a patch.
template <class S>
struct ListPatch {
  GridNodes<S> nodes;
  FixedNodes<S> fixed;
  NodeIndices<S> patch, node;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (patch(i) < 0) return;
    for (int k = 0; k < 27; ++k) {
      int const j = neighbour(nodes, i, k);
      node(27 * patch(i) + k) = j >= 0 && !is_fixed<S>(fixed, j) ? j : -1;
    }
  }
};

/// How many patches hold a node.
template <class S>
struct CountPatches {
  GridNodes<S> nodes;
  FixedNodes<S> fixed;
  NodeIndices<S> patch, count;
  KOKKOS_FUNCTION void operator()(int i) const {
    count(i) = 0;
    if (is_fixed<S>(fixed, i)) return;
    for (int k = 0; k < 27; ++k) {
      int const j = neighbour(nodes, i, k);
      count(i) += j >= 0 && patch(j) >= 0;
    }
  }
};

template <class S>
struct IsHeld {
  NodeIndices<S> count;
  KOKKOS_FUNCTION int operator()(int i) const { return count(i) > 0; }
};
template <class S>
struct NumberRows {
  NodeIndices<S> count, row;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (count(i) == 0) row(i) = -1;
  }
};

/// The lower triangle of the matrix of a patch; what is no node of it is the identity.
template <class S, int radius>
struct LoadPatch {
  using Triangle = PackedTriangle;
  GridMatrix<S, double, radius> rows;
  NodeIndices<S> node, row;
  int run;
  KOKKOS_FUNCTION void operator()(typename S::team_member const& team, double* g) const {
    int const* const own = node.data() + 27 * team.league_rank();
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, run), [&](int v) {
      if (v >= 27 || own[v] < 0) {
        for (int i = 3 * v; i < 3 * v + 3; ++i) g[Triangle::row(i) + i] = 1;
        return;
      }
      int const from = row(own[v]);
      for (int w = 0; w <= v; ++w) {
        if (own[w] < 0) continue;
        Mat3<double> const b =
            rows.block(from, w / 9 - v / 9, w / 3 % 3 - v / 3 % 3, w % 3 - v % 3);
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3 && 3 * w + c <= 3 * v + r; ++c)
            g[Triangle::row(3 * v + r) + 3 * w + c] = b(r, c);
      }
    });
  }
};

/// What patches solve for: W r.
template <class S, class T>
struct GatherPatches {
  NodeIndices<S> node, count;
  VectorField<T, S> r, to;
  int run;
  KOKKOS_FUNCTION void operator()(int t) const {
    int const patch = t / run, k = t % run;
    int const i = k < 27 ? node(27 * patch + k) : -1;
    T const w = i < 0 ? T(0) : T(1) / Kokkos::sqrt(T(count(i)));
    for (int c = 0; c < 3; ++c) to(t, c) = i < 0 ? T(0) : w * r(i, c);
  }
};

/// z = M r
template <class S, class T>
struct JoinPatches {
  GridNodes<S> nodes;
  NodeIndices<S> patch, count;
  BlockField<T, S> inverse;
  VectorField<T, S> r, solved, z;
  int run;
  KOKKOS_FUNCTION void operator()(int i) const { join(i); }
  [[gnu::noinline]] KOKKOS_FUNCTION void join(int i) const {
    if (count.extent(0) == 0 || count(i) == 0) {
      set_vector(z, i, block_times(inverse, i, vector_of<T>(r, i)));
      return;
    }
    Vec3<T> sum{0, 0, 0};
    for (int k = 0; k < 27; ++k) {
      int const j = neighbour(nodes, i, k);
      if (j < 0 || patch(j) < 0) continue;
      // Seen from j the node is on the other side.
      sum = sum + vector_of<T>(solved, run * patch(j) + 26 - k);
    }
    set_vector(z, i, (T(1) / Kokkos::sqrt(T(count(i)))) * sum);
  }
};

}  // namespace kernels

/// A level without a matrix, with M in the place of D^-1. `Action` also has `add_rows(matrix,
/// row_of)`, see ParticleOperator; nodes up to `radius` apart are coupled.
template <class Action, class S_, class T, int radius = 2>
class PatchedLevel : public ActionLevel<Action, S_, T> {
  using Base = ActionLevel<Action, S_, T>;

public:
  using S = S_;
  using Vectors = typename Base::Vectors;

  void set(CutCells const& params) { params_ = params; }
  void finish() {
    int const n = this->size();
    this->action_->diagonal(this->inverse_);
    find_patches();
    for_each<S>("level_invert", n, kernels::InvertLevelBlocks<S, T>{this->inverse_});
    grow(z_, "level_vector", static_cast<std::size_t>(n));
  }
  /// M r, valid until the next call.
  Vectors const& preconditioned(Vectors const& r) const {
    if (patches_ > 0) {
      for_each<S>("gather_patches", run * patches_,
                  kernels::GatherPatches<S, T>{node_, count_, r, right_, run});
      solve_.apply(right_, solved_);
    }
    for_each<S>("join_patches", this->size(),
                kernels::JoinPatches<S, T>{this->nodes_, patch_,
                                           patches_ > 0 ? count_ : kernels::NodeIndices<S>(),
                                           this->inverse_, r, solved_, z_, run});
    return z_;
  }
  int patches() const { return patches_; }
  std::size_t memory() const { return Base::memory() + solve_.memory(); }

private:
  static constexpr int run = 32;  ///< unknowns of a patch, padded

  void find_patches() {
    GridNodes<S> const& nodes = this->nodes_;
    int const n = nodes.count;
    patches_ = 0;
    if (params_.ratio == 0 || n == 0) return;
    grow(patch_, "cut_patch", static_cast<std::size_t>(n));
    grow(count_, "cut_count", static_cast<std::size_t>(n));
    grow(row_, "cut_row", static_cast<std::size_t>(n));
    kernels::IsCut<S, T> const is_cut{nodes, this->fixed_, this->inverse_, params_.ratio};
    patches_ = exclusive_scan<S, int>("cut_cells", n, is_cut, patch_);
    if (patches_ == 0) return;
    for_each<S>("number_patches", n, kernels::NumberPatches<S, T>{is_cut, patch_});
    grow(node_, "cut_node", std::size_t(27) * patches_);
    for_each<S>("list_patches", n, kernels::ListPatch<S>{nodes, this->fixed_, patch_, node_});
    for_each<S>("count_patches", n, kernels::CountPatches<S>{nodes, this->fixed_, patch_, count_});
    int const held = exclusive_scan<S, int>("cut_rows", n, kernels::IsHeld<S>{count_}, row_);
    for_each<S>("number_rows", n, kernels::NumberRows<S>{count_, row_});

    GridMatrix<S, double, radius> rows;
    rows.nodes = nodes;
    rows.entry = decltype(rows.entry)("cut_rows", held);
    this->action_->add_rows(rows, row_);
    solve_ = AggregateInverse<S, T>(run * patches_, run);
    solve_.factorize_loaded(kernels::LoadPatch<S, radius>{rows, node_, row_, run});
    right_ = right_memory_.resize("cut_right", static_cast<std::size_t>(run) * patches_);
    solved_ = solved_memory_.resize("cut_solved", static_cast<std::size_t>(run) * patches_);
  }

  CutCells params_;
  int patches_ = 0;
  kernels::NodeIndices<S> patch_, count_, row_, node_;
  AggregateInverse<S, T> solve_;
  Vectors right_, solved_, z_;
  Resizable<Vectors> right_memory_, solved_memory_;
};

}  // namespace taut
