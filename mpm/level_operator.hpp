// What a smoother sees of a level: a symmetric operator, the inverses of its diagonal blocks, and
// vectors to work on.
#pragma once

#include <taut/mpm/galerkin.hpp>

#include <concepts>

namespace taut {

/// The vectors of a level. Allocates only where there are more nodes than ever.
template <class T, class S>
struct LevelVectors {
  using Vectors = VectorField<T, S>;
  Vectors b, x, r;     ///< right-hand side, solution, residual
  Vectors d, y;        ///< step, and the operator times something
  Reducer<S> reducer;  ///< for one sum

  void resize(int n) {
    for (Vectors* v : {&b, &x, &r, &d, &y}) grow(*v, "level_vector", static_cast<std::size_t>(n));
    reducer.provide(n, 1);
  }
};

/// `A` is what smoothers smooth with.
template <class A>
concept LevelOperator = requires(A const& a,
                                 VectorField<typename A::Scalar, typename A::Space> const& x) {
  { a.size() } -> std::convertible_to<int>;
  { a.nodes() } -> std::convertible_to<GridNodes<typename A::Space>>;
  /// y = A x
  {a.product(x, x)};
  /// r = b - A x
  {a.residual(x, x, x)};
  { a.inverse() } -> std::convertible_to<BlockField<typename A::Scalar, typename A::Space>>;
};

namespace kernels {

/// r = b - A x
template <class S, class T>
struct StoreResidual {
  VectorField<T, S> b, r;
  KOKKOS_FORCEINLINE_FUNCTION Vec3<T> operator()(int i, Vec3<T> const& own,
                                                 Vec3<T> const& sum) const {
    set_vector(r, i, vector_of<T>(b, i) - sum);
    return own;
  }
};

template <class T, class Blocks>
KOKKOS_FORCEINLINE_FUNCTION Vec3<T> block_times(Blocks const& blocks, int i, Vec3<T> const& v) {
  return Sym3<T>{
             {blocks(i, 0), blocks(i, 1), blocks(i, 2), blocks(i, 3), blocks(i, 4), blocks(i, 5)}} *
         v;
}

/// y = b - y
template <class S, class T>
struct SubtractFrom {
  VectorField<T, S> b, y;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) y(i, c) = b(i, c) - y(i, c);
  }
};

/// to = from, of other precision perhaps.
template <class S, class From, class To>
struct ConvertVectors {
  VectorField<From, S> from;
  VectorField<To, S> to;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) to(i, c) = To(from(i, c));
  }
};

template <class S, class T>
struct InvertLevelBlocks {
  BlockField<T, S> blocks;
  KOKKOS_FUNCTION void operator()(int i) const {
    Sym3<T> d;
    for (int k = 0; k < 6; ++k) d.s[k] = blocks(i, k);
    d = floored_inverse(d, 1e-6, 0.0);
    for (int k = 0; k < 6; ++k) blocks(i, k) = d.s[k];
  }
};

/// to += from
template <class S, class T>
struct AddVectors {
  VectorField<T, S> from, to;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) to(i, c) += from(i, c);
  }
};

}  // namespace kernels

/// A level with an assembled matrix. As the fine level of a hierarchy it also says which nodes are
/// fixed.
template <class S_, class T, int radius_>
class MatrixLevel {
public:
  using Space = S_;
  using Scalar = T;
  static constexpr int radius = radius_;
  using Vectors = VectorField<T, Space>;

  /// Takes on the nodes; the matrix is then to be filled, with zero pads (set_zero or galerkin).
  void resize(GridNodes<Space> const& nodes, FixedNodes<Space> const& fixed = {}) {
    matrix_.resize(nodes);
    fixed_ = fixed;
    grow(inverse_, "level_inverse", static_cast<std::size_t>(nodes.count));
  }
  /// After the matrix was filled: cuts fixed nodes off, and inverts the diagonal blocks.
  void finish() {
    if (fixed_.extent(0) > 0) cut_off_fixed(matrix_, fixed_);
    invert_diagonal(matrix_, inverse_);
  }

  GridMatrix<Space, T, radius> const& matrix() const { return matrix_; }
  GridNodes<Space> const& nodes() const { return matrix_.nodes; }
  FixedNodes<Space> const& fixed() const { return fixed_; }
  BlockField<T, Space> const& inverse() const { return inverse_; }
  int size() const { return matrix_.size(); }

  void product(Vectors const& x, Vectors const& y) const { taut::product(matrix_, x, y); }
  void residual(Vectors const& b, Vectors const& x, Vectors const& r) const {
    sweep_blocks("grid_residual", matrix_, x, kernels::StoreResidual<Space, T>{b, r},
                 kernels::Part::all, false, false);
  }
  /// Fills the matrix of the level below.
  template <class Embedding, class TC, int RC>
  void coarse_matrix(GridMatrix<Space, TC, RC> const& coarse) const {
    galerkin<Embedding>(matrix_, fixed_, coarse);
  }
  std::size_t memory() const { return matrix_.memory() + inverse_.span() * sizeof(T); }

private:
  GridMatrix<Space, T, radius> matrix_;
  BlockField<T, Space> inverse_;
  FixedNodes<Space> fixed_;
};

/// A level without a matrix, after any symmetric operator that is told by
///   `action.product(x, y)`                  y = A x, zero at fixed nodes
///   `action.diagonal(blocks)`               the diagonal blocks, 6 numbers each
///   `action.template coarse_matrix<Embedding>(coarse)`   fills a GridMatrix with P'AP
template <class Action, class S_, class T>
class ActionLevel {
public:
  using Space = S_;
  using Scalar = T;
  using Vectors = VectorField<T, Space>;

  void resize(GridNodes<Space> const& nodes, FixedNodes<Space> const& fixed, Action const& action) {
    nodes_ = nodes;
    fixed_ = fixed;
    action_ = &action;
    grow(inverse_, "level_inverse", static_cast<std::size_t>(nodes.count));
  }
  void finish() {
    action_->diagonal(inverse_);
    for_each<Space>("level_invert", size(), kernels::InvertLevelBlocks<Space, T>{inverse_});
  }

  GridNodes<Space> const& nodes() const { return nodes_; }
  FixedNodes<Space> const& fixed() const { return fixed_; }
  BlockField<T, Space> const& inverse() const { return inverse_; }
  int size() const { return nodes_.count; }

  void product(Vectors const& x, Vectors const& y) const { action_->product(x, y); }
  void residual(Vectors const& b, Vectors const& x, Vectors const& r) const {
    product(x, r);
    for_each<Space>("level_residual", size(), kernels::SubtractFrom<Space, T>{b, r});
  }
  template <class Embedding, class TC, int RC>
  void coarse_matrix(GridMatrix<Space, TC, RC> const& coarse) const {
    action_->template coarse_matrix<Embedding>(coarse);
  }
  std::size_t memory() const { return inverse_.span() * sizeof(T); }

protected:
  GridNodes<Space> nodes_;
  FixedNodes<Space> fixed_;
  Action const* action_ = nullptr;
  BlockField<T, Space> inverse_;
};

}  // namespace taut
