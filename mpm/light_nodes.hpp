// Nodes that hardly any particle sees, at surfaces and in the corners of cut cells. A few particles
// leave motions of them that cost next to nothing, and are as far from smooth as from being seen by
// a node alone: where waves cross thousands of cells in a step such a motion has no more than its
// inertia to hold it back, 1e-7 of what single nodes have, and neither Chebyshev's polynomial nor a
// coarser level does anything about it. So all such nodes together are solved with exactly,
//
//   x = A_ll^-1 b_l,  a cycle on what is left,  x += A_ll^-1 r_l,
//
// which is symmetric, and positive definite where the cycle is. They lie along surfaces, so that
// the factor stays sparse (some 130 numbers a row at 2000 nodes).
#pragma once

#include <taut/mpm/cut_cells.hpp>
#include <taut/mpm/exact_block.hpp>

namespace taut {

template <class S, class T, int radius>
class LightNodes {
public:
  using Vectors = VectorField<T, S>;

  /// Takes the nodes where the trace of the diagonal block of A is below `ratio` times the largest
  /// of the 26 around; `action` as for PatchedLevel. False, and nothing is to be applied, if there
  /// is none, or are more than `most`, or their block is not positive definite.
  template <class Action>
  bool build(Action const& action, double ratio, int most) {
    GridNodes<S> const& nodes = action.nodes();
    std::size_t const n = static_cast<std::size_t>(nodes.count);
    size_ = nodes.count;
    grow(diagonal_, "light_diagonal", n);
    grow(part_, "light_nodes", n);
    action.diagonal(diagonal_);
    kernels::IsCut<S, T> const is_light{nodes, action.fixed(), diagonal_, ratio};
    int const count = exclusive_scan<S, int>("light_nodes", size_, is_light, part_);
    on_ = count > 0 && count <= most;
    if (!on_) return false;
    for_each<S>("light_nodes", size_, kernels::NumberPatches<S, T>{is_light, part_});
    rows_.nodes = nodes;
    grow(rows_.entry, "light_rows", static_cast<std::size_t>(count));
    for_each<S>("light_rows", count, kernels::ZeroRow<Rows>{rows_});
    action.add_rows(rows_, part_);
    on_ =
        block_.factorize(rows_, part_, count, true, 16 * double(std::numeric_limits<T>::epsilon()));
    grow(r_, "light_residual", n);
    grow(z_, "light_cycle", n);
    return on_;
  }
  bool on() const { return on_; }
  int nodes() const { return on_ ? block_.nodes() : 0; }
  std::size_t memory() const {
    return block_.memory() + (diagonal_.span() + r_.span() + z_.span()) * sizeof(T) +
           rows_.entry.span() * sizeof(double);
  }

  /// x = M b, with `cycle(r, z)` for the nodes together and `product(x, y)`, y = A x.
  template <class Product, class Cycle>
  void apply(Vectors const& b, Vectors const& x, Product const& product, Cycle const& cycle) const {
    block_.solve(b, x, size_, false);
    residual(b, x, product);
    cycle(r_, z_);
    for_each<S>("light_add", size_, kernels::AddVectors<S, T>{z_, x});
    residual(b, x, product);
    block_.solve(r_, x, size_, true);
  }

private:
  using Rows = GridMatrix<S, double, radius>;

  /// r = b - A x
  template <class Product>
  void residual(Vectors const& b, Vectors const& x, Product const& product) const {
    product(x, r_);
    for_each<S>("light_residual", size_, kernels::SubtractFrom<S, T>{b, r_});
  }

  bool on_ = false;
  int size_ = 0;
  BlockField<T, S> diagonal_;
  kernels::NodeIndices<S> part_;
  Rows rows_;
  ExactBlock<S> block_;
  Vectors r_, z_;
};

}  // namespace taut
