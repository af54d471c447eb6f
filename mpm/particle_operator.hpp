// The Hessian at an iterate without a matrix: the numbers of particle_operator_kernels.hpp, and a
// block for each node of what acts on it alone (inertia, slip); a ghost penalty besides. What
// ActionLevel takes as the fine level of a hierarchy: products, diagonal blocks, and the matrix of
// the next coarser level from the particles at once. The fine matrix, too, where it is wanted. Of
// the scalar of the gradient or rounded to float, which halves the bytes that a product reads.
//
// Who the particles are of is not known here: terms write the numbers (linearise), each those of
// its materials.
#pragma once

#include <taut/mpm/ghost_kernels.hpp>
#include <taut/mpm/material_range.hpp>
#include <taut/mpm/particle_assembly.hpp>

#include <vector>

namespace taut {

template <Spline K, class T_, class S_ = DefaultSpace, bool packed = S_::on_host>
class ParticleOperator {
public:
  using S = S_;
  using T = T_;
  using Vectors = VectorField<T, S>;
  using Blocks = BlockField<T, S>;
  template <class N>
  using List = Kokkos::View<N*, typename S::memory>;

  /// For the particles in `blocks`, which are bound to `nodes`; `team_size` is how many threads do
  /// a patch. The numbers are then to be written.
  void resize(BlockViews<K, S> const& blocks, GridNodes<S> const& nodes, int team_size) {
    blocks_ = blocks;
    nodes_ = nodes;
    team_size_ = packed ? 1 : team_size;
    grow(numbers_, "operator_numbers", std::size_t(kernels::operator_numbers) * blocks.slots);
    grow(partial_, "operator_partial", std::size_t(6) * BlockViews<K, S>::nodes * blocks.patches);
  }
  List<T> const& numbers() const { return numbers_; }
  /// What acts on nodes alone, and which are fixed (not 0; those keep their block and nothing
  /// else).
  void set_local(Blocks const& local, FixedNodes<S> const& fixed) {
    local_ = local;
    fixed_ = fixed;
  }

  /// Becomes the Hessian of a potential at x; `local` is room for the blocks of single nodes, in
  /// the scalar of its gradient, which it goes on reading.
  template <class E, class Positions, class Real>
  void linearise(E& e, Positions const& x, BlockField<Real, S> const& local) {
    std::vector<int> terms_of;
    if constexpr (ShowsTerms<E>) {
      terms_of = terms_of_materials(e);
      for (int const terms : terms_of) {
        if (terms == 1) continue;
        throw Error(
            "{} terms over the particles hold one material, and share no operator: take a "
            "preconditioner that needs none (block Jacobi)",
            terms);
      }
    }
    set_ghosts({}, 1);  // unless a term has some
    e.linearise(x, *this, local);
    if (ShowsTerms<E> && int(terms_of.size()) != blocks_.materials) {
      throw Error("the particles are sorted by {} materials, of which terms hold {}",
                  blocks_.materials, terms_of.size());
    }
    if constexpr (std::same_as<Real, T>) {
      set_local(local, e.fixed());
    } else {
      Blocks const rounded = local_memory_.resize("operator_local", local.extent(0));
      for_each<S>("round_blocks", nodes_.count, kernels::RoundBlocks<S, Real, T>{local, rounded});
      set_local(rounded, e.fixed());
    }
  }
  /// Rows of a ghost penalty, times `scale`; those of before until they are told anew.
  void set_ghosts(GhostRows<S> const& rows, double scale) {
    ghosts_ = rows;
    ghost_scale_ = scale;
  }

  GridNodes<S> const& nodes() const { return nodes_; }
  BlockViews<K, S> const& blocks() const { return blocks_; }
  int team_size() const { return team_size_; }
  FixedNodes<S> const& fixed() const { return fixed_; }

  /// y = A x
  void product(Vectors const& x, Vectors const& y) const {
    run("operator_product",
        kernels::OperatorProduct<S, T, K, packed>{{{blocks_}, numbers_, partial_}, {fixed_, x}});
    using Output = kernels::OperatorProductOutput<S, T>;
    for_each<S>("operator_gather", nodes_.count,
                kernels::GatherRows<S, T, K, 3, Output>{blocks_, partial_, {fixed_, local_, x, y}});
    if (ghosts_.count == 0) return;
    using Field = kernels::FreeField<S, T>;
    for_each<S>("operator_ghosts", ghosts_.count,
                kernels::GhostForce<S, Field>{ghosts_, {fixed_, x}, ghost_scale_});
    spread_ghosts(y, {});
  }
  void diagonal(Blocks const& blocks) const {
    run("operator_diagonal",
        kernels::OperatorDiagonal<S, T, K, packed>{{{blocks_}, numbers_, partial_}});
    using Output = kernels::OperatorDiagonalOutput<S, T>;
    for_each<S>(
        "operator_gather", nodes_.count,
        kernels::GatherRows<S, T, K, 6, Output>{blocks_, partial_, {fixed_, local_, blocks}});
    if (ghosts_.count > 0) spread_ghosts({}, blocks);
  }
  /// `coarse`, which has its nodes already, becomes P'AP.
  template <class Embedding, class TM, int R>
  void coarse_matrix(GridMatrix<S, TM, R> const& coarse) const {
    set_zero(coarse);
    add_particles<Embedding>(coarse, {}, true);
    mirror(coarse);
    for_each<S>("add_coarse_blocks", coarse.size(),
                kernels::AddCoarseBlocks<S, Embedding, T, TM, R>{nodes_, fixed_, local_, coarse});
    if (ghosts_.count == 0) return;
    for_each<S>(
        "add_coarse_ghosts", coarse.size(),
        kernels::AddCoarseGhosts<S, Embedding, TM, R>{ghosts_, fixed_, ghost_scale_, coarse});
  }
  /// `matrix`, over the same nodes, becomes A, fixed nodes cut off.
  template <class TM, int R>
  void matrix(GridMatrix<S, TM, R> const& matrix) const {
    set_zero(matrix);
    add_particles<NoEmbedding>(matrix, {}, true);
    mirror(matrix);
    add_local(matrix, {});
  }
  /// Adds the rows of A of the nodes for which `row_of` is not negative to these rows of `matrix`.
  template <class TM, int R>
  void add_rows(GridMatrix<S, TM, R> const& matrix, List<int const> const& row_of) const {
    add_particles<NoEmbedding>(matrix, row_of, false);
    add_local(matrix, row_of);
  }
  /// Bytes held.
  std::size_t memory() const {
    return (numbers_.span() + partial_.span() + local_.span()) * sizeof(T);
  }

private:
  template <class Kernel>
  void run(char const* name, Kernel const& kernel) const {
    for_each_team<S>(name, blocks_.patches, team_size_, kernel.scratch_bytes(), kernel);
  }
  template <class TM, int R>
  void add_local(GridMatrix<S, TM, R> const& matrix, List<int const> const& row_of) const {
    for_each<S>("add_node_blocks", nodes_.count,
                kernels::AddNodeBlocks<S, T, TM, R>{local_, row_of, matrix});
    if constexpr (R >= 2) {
      if (ghosts_.count == 0) return;
      for_each<S>("add_ghost_rows", nodes_.count,
                  kernels::AddGhostRows<S, TM, R>{ghosts_, fixed_, ghost_scale_, row_of, matrix});
    }
  }
  void spread_ghosts(Vectors const& to, Blocks const& blocks) const {
    for_each<S>("spread_ghosts", nodes_.count,
                kernels::SpreadGhosts<S, T>{ghosts_, fixed_, ghost_scale_, to, {}, blocks});
  }
  template <class TM, int R>
  static void mirror(GridMatrix<S, TM, R> const& matrix) {
    for_each<S>("mirror_rows", matrix.size(), kernels::MirrorRow<S, TM, R>{matrix});
  }
  template <class Embedding, class TM, int R>
  void add_particles(GridMatrix<S, TM, R> const& matrix, List<int const> const& row_of,
                     bool half) const {
    BlockColours<K, S> const colours(blocks_);
    for (int c = 0; c < colours.colours; ++c) {
      for_each<S>(
          "assemble_cells", colours.size(c),
          kernels::AssembleCells<S, T, K, Embedding, TM, R>{
              blocks_, numbers_, fixed_, colours.order(), colours.begin(c), matrix, row_of, half});
    }
  }

  BlockViews<K, S> blocks_;
  GridNodes<S> nodes_;
  FixedNodes<S> fixed_;
  int team_size_ = 1;
  List<T> numbers_, partial_;
  Blocks local_;
  Resizable<Blocks> local_memory_;  ///< where they are rounded
  GhostRows<S> ghosts_;
  double ghost_scale_ = 1;
};

}  // namespace taut
