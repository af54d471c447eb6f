// What turns a gradient into a direction: z = P g with P symmetric, positive definite and close to
// H^-1. Pointwise preconditioners are one small matrix per unknown; the passes over the unknowns
// apply them in passing, and the gradient sweep delivers the curvature that they are made of.
#pragma once

#include <taut/core/math/floored_inverse.hpp>
#include <taut/core/potential/preconditioning.hpp>
#include <taut/integrators/fields.hpp>

#include <concepts>

namespace taut {

/// `M` is a preconditioner for the Objective `E`.
template <class M, class E>
concept Preconditioner =
    requires(M& m, M const& c, E& e, int size,
             VectorField<typename E::Precision::position, typename E::Space> const& x,
             VectorField<typename E::Precision::real, typename E::Space> const& g) {
  typename M::Params;
  {M(typename M::Params())};
  { c.refresh() } -> std::convertible_to<Refresh>;
  {m.resize(size)};
  /// The curvature that it wants from the gradient sweep before an update: the fields that are not
  /// empty.
  { c.curvature() } -> std::convertible_to<LocalMatrices<typename E::Precision, typename E::Space>>;
  /// Makes P from the curvature delivered at x, or from e itself.
  {m.update(e, x)};
  /// True if P is what update() has left in curvature().
  { c.pointwise() } -> std::convertible_to<bool>;
  /// z = P g into the second argument.
  {c.apply(g, g)};
};

namespace kernels {

template <class P, class S>
struct ApplyLocal {
  LocalMatrices<P, S> matrices;
  VectorField<typename P::real, S> g, z;
  KOKKOS_FUNCTION void operator()(int i) const {
    store3(z, i, matrices.product(i, load3<typename P::real>(g, i)));
  }
};

template <class Field>
struct LargestDiagonalEntry {
  Field curvature;
  KOKKOS_FUNCTION void operator()(int i, double& largest) const {
    for (int c = 0; c < 3; ++c) largest = Kokkos::max(largest, double(curvature(i, c)));
  }
};

template <class P, class S>
struct InvertDiagonals {
  VectorField<typename P::real, S> diagonal;
  typename P::real floor;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) diagonal(i, c) = 1 / Kokkos::max(diagonal(i, c), floor);
  }
};

template <class P, class S>
struct InvertBlocks {
  BlockField<typename P::real, S> blocks;
  double relative_floor, floor;
  KOKKOS_FUNCTION void operator()(int i) const {
    Sym3<typename P::real> block;
    for (int k = 0; k < 6; ++k) block.s[k] = blocks(i, k);
    block = floored_inverse(block, relative_floor, floor);
    for (int k = 0; k < 6; ++k) blocks(i, k) = block.s[k];
  }
};

}  // namespace kernels

/// What pointwise preconditioners have in common.
template <class P, class S>
class PointwisePreconditioner {
public:
  using Real = typename P::real;
  using Vectors = VectorField<Real, S>;

  bool pointwise() const { return true; }
  LocalMatrices<P, S> const& curvature() const { return local_; }
  void apply(Vectors const& g, Vectors const& z) const {
    int const n = static_cast<int>(g.extent(0));
    for_each<S>("apply_local", n, kernels::ApplyLocal<P, S>{local_, g, z});
  }

protected:
  /// With inertia every block is at least the mass. Without, curvature may vanish at an unknown; it
  /// is then taken for `relative` times the largest of all.
  template <class E, class Field>
  static Real floor_without_inertia(E& e, Field const& field, double relative) {
    if (e.scale().has_inertia) return 0;
    return Real(relative * maximum<S>("largest_curvature", e.size(), 0.0,
                                      kernels::LargestDiagonalEntry<Field>{field}));
  }

  LocalMatrices<P, S> local_;
};

/// P = 1.
template <class P = Mixed, class S = DefaultSpace>
class Identity : public PointwisePreconditioner<P, S> {
public:
  struct Params {};
  static constexpr char const* name = "identity";

  explicit Identity(Params const& = {}) {}
  Refresh refresh() const { return {.interval = std::numeric_limits<int>::max()}; }
  void resize(int) {}
  template <class E>
  void update(E&, VectorField<typename P::position, S> const&) {}
};

/// P = 1 / diag(H), the paper's.
template <class P = Mixed, class S = DefaultSpace>
class Jacobi : public PointwisePreconditioner<P, S> {
public:
  struct Params {
    Refresh refresh = {};
    double floor = 1e-6;  ///< smallest entry over the largest of all, where there is no inertia
  };
  static constexpr char const* name = "jacobi";

  Jacobi() : Jacobi(Params()) {}
  explicit Jacobi(Params const& params) : params_(params) {}
  Refresh refresh() const { return params_.refresh; }
  void resize(int n) { diagonal() = memory_.resize("jacobi", n); }
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const&) {
    auto const floor = this->floor_without_inertia(e, diagonal(), params_.floor);
    for_each<S>("invert_diagonals", e.size(), kernels::InvertDiagonals<P, S>{diagonal(), floor});
  }

private:
  VectorField<typename P::real, S>& diagonal() { return this->local_.diagonal; }
  Params params_;
  Resizable<VectorField<typename P::real, S>> memory_;
};

/// P = inverses of the diagonal 3x3 blocks of H, with the eigenvalues of each raised to `floor`
/// times its largest.
template <class P = Mixed, class S = DefaultSpace>
class BlockJacobi : public PointwisePreconditioner<P, S> {
public:
  struct Params {
    Refresh refresh = {};
    double floor = 1e-5;
  };
  static constexpr char const* name = "block_jacobi";

  BlockJacobi() : BlockJacobi(Params()) {}
  explicit BlockJacobi(Params const& params) : params_(params) {}
  Refresh refresh() const { return params_.refresh; }
  void resize(int n) { blocks() = memory_.resize("block_jacobi", n); }
  template <class E>
  void update(E& e, VectorField<typename P::position, S> const&) {
    auto const floor = this->floor_without_inertia(e, blocks(), params_.floor);
    for_each<S>("invert_blocks", e.size(),
                kernels::InvertBlocks<P, S>{blocks(), params_.floor, double(floor)});
  }

private:
  BlockField<typename P::real, S>& blocks() { return this->local_.blocks; }
  Params params_;
  Resizable<BlockField<typename P::real, S>> memory_;
};

}  // namespace taut
