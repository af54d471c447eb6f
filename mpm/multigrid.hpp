// Galerkin multigrid over the nodes of a grid (Wang et al. 2020, sections 4 and 5): one cycle is a
// symmetric operator close to the inverse of the matrix of its fine level, so it serves as a
// preconditioner and as the initial metric of L-BFGS.
//
//   smooth, restrict the residual, a cycle on the coarser level (or two: a W-cycle), prolong,
//   smooth
//
// Every coarser level has the nodes that the finer one is interpolated from, and the matrix P'AP,
// down to so few nodes that a dense inverse is cheap, or a sparse factor. What the fine level is (a
// matrix, or an operator without one), how it hangs on the next, and how levels are smoothed are
// policies; and where the matrices of the coarser levels come from, if not from P'AP.
#pragma once

#include <taut/core/sparse/dense_inverse.hpp>
#include <taut/mpm/exact_block.hpp>
#include <taut/mpm/grid_level.hpp>
#include <taut/mpm/level_pcg.hpp>
#include <taut/mpm/smoother.hpp>

#include <algorithm>
#include <deque>
#include <vector>

namespace taut {

namespace kernels {

/// The dense matrix of a level, by rows.
template <class S, class T, int radius>
struct SpreadRow {
  GridMatrix<S, T, radius> a;
  Kokkos::View<double**, Kokkos::LayoutRight, typename S::memory> to;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int j = 0; j < 3 * a.size(); ++j)
      for (int r = 0; r < 3; ++r) to(3 * i + r, j) = 0;
    for (int dx = -radius; dx <= radius; ++dx)
      for (int dy = -radius; dy <= radius; ++dy)
        for (int dz = -radius; dz <= radius; ++dz) {
          int const j = a.nodes.beside(i, dx, dy, dz);
          if (j < 0) continue;
          Mat3<T> const b = a.block(i, dx, dy, dz);
          for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) to(3 * i + r, 3 * j + c) = double(b(r, c));
        }
  }
};

template <class S>
struct NumberAll {
  NodeIndices<S> to;
  KOKKOS_FUNCTION void operator()(int i) const { to(i) = i; }
};

/// b = 0 at fixed nodes.
template <class S, class T>
struct ClearFixed {
  FixedNodes<S> fixed;
  VectorField<T, S> b;
  KOKKOS_FUNCTION void operator()(int i) const {
    if (fixed(i) == 0) return;
    for (int c = 0; c < 3; ++c) b(i, c) = 0;
  }
};

}  // namespace kernels

/// Makes coarser levels by other means than P'AP of the finer one.
template <class S, class T, int radius>
struct LevelSource {
  virtual ~LevelSource() = default;
  /// `level` becomes number `l` below the fine one: resized to its nodes and to which are fixed,
  /// and filled, but not finished. Called for 0, 1, ..., in this order.
  virtual void make(int l, MatrixLevel<S, T, radius>& level) = 0;
};

/// What a hierarchy has become.
struct MultigridReport {
  std::vector<int> nodes;  ///< of each level, from the finest
  bool direct = false;     ///< whether the coarsest level is solved exactly; else it is smoothed
  double shift = 0;        ///< that the coarsest matrix needed to be positive definite, see
                           ///< invert_positive
  std::size_t memory = 0;  ///< bytes of matrices
};

/// `Fine` is the fine level (MatrixLevel or ActionLevel), `T` the scalar of the coarser ones.
template <class Fine, class FineSmoother = ForwardBackward, class Smoother = ForwardBackward,
          class Embedding = LinearEmbedding, class T = float>
class Multigrid {
public:
  using Space = typename Fine::Space;
  using S = Space;
  using FineScalar = typename Fine::Scalar;
  /// Stencils of every coarser level, whatever that of the fine one.
  static constexpr int radius = Embedding::radius == 1 ? 2 : 3;

  struct Params {
    int max_levels = 20;    ///< the fine one counted
    int direct_nodes = 60;  ///< the coarsest level may have so many; there is no coarser one then
    /// Where above direct_nodes: the coarsest level may have so many, and is solved by a sparse
    /// factor, on the host.
    int sparse_nodes = 0;
    int visits = 1;         ///< of a coarser level in a cycle: 1 is a V-cycle, 2 a W-cycle
    int coarse_sweeps = 8;  ///< of the coarsest level, where it is not inverted
    /// Above 0, where the coarsest level is not inverted: it is solved by conjugate gradients until
    /// the residual is this part of what the right-hand side of the cycle, restricted without
    /// smoothing, amounts to (HOT: 1/2), which may be at once.
    double coarse_tolerance = 0;
    /// The part of the right-hand side of the coarsest level itself instead: then there is always
    /// something to do.
    bool coarse_by_own = false;
    int coarse_iterations = 10000;  ///< of these, at most
    typename FineSmoother::Params fine = {};
    typename Smoother::Params smoother = {};
  };

  Multigrid() : Multigrid(Params()) {}
  explicit Multigrid(Params const& params) : params_(params), fine_smoother_(params.fine) {}

  using Source = LevelSource<Space, T, radius>;

  /// Builds all levels below `fine`, which is finished and must outlive this, from `source` if
  /// there is one. Allocates what is larger than ever, and scratch for the coarsest level.
  void build(Fine const& fine, Source* source = nullptr) {
    fine_ = &fine;
    source_ = source;
    report_ = {};
    coarse_count_ = 0;
    report_.nodes.push_back(fine.size());
    fine_vectors_.resize(fine.size());
    fine_smoother_.setup(fine, fine_vectors_);
    used_ = 0;
    if (source_ == nullptr) list_free_nodes();
    LeafList const* finer = &free_;
    double dx = fine.nodes().dx;
    while (add_level(*finer, dx)) {
      finer = &levels_[used_ - 1].grid.leaves();
      dx *= 2;
    }
    if (used_ > 0) invert_coarsest();
    if (solves_by_pcg()) {
      for (std::size_t l = 0; l < used_; ++l) {
        grow(levels_[l].unsmoothed, "level_vector",
             static_cast<std::size_t>(levels_[l].level.size()));
      }
    }
    for (std::size_t l = 0; l < used_; ++l) report_.memory += levels_[l].level.memory();
    report_.memory += fine.memory();
  }

  /// z = (one cycle from nothing) g. Allocates nothing.
  template <class X>
  void apply(VectorField<X, S> const& g, VectorField<X, S> const& z) const {
    int const n = fine_->size();
    for_each<S>("cycle_begin", n, kernels::ConvertVectors<S, X, FineScalar>{g, fine_vectors_.b});
    cycle();
    for_each<S>("cycle_end", n, kernels::ConvertVectors<S, FineScalar, X>{fine_vectors_.x, z});
  }

  /// Of hierarchies that are built from now on.
  void set_sparse_nodes(int most) { params_.sparse_nodes = most; }
  MultigridReport const& report() const { return report_; }
  /// Of conjugate gradients on the coarsest level, in all cycles since `build`.
  int coarse_iterations() const { return coarse_count_; }
  Params const& params() const { return params_; }
  /// Level `l` below the fine one.
  MatrixLevel<S, T, radius> const& level(int l) const { return levels_[l].level; }

private:
  struct Level {
    GridLevel<S> grid;
    MatrixLevel<S, T, radius> level;
    LevelVectors<T, S> vectors;
    VectorField<T, S> before;      ///< what the visits before have found
    VectorField<T, S> unsmoothed;  ///< the right-hand side of the cycle, restricted as it is
    Smoother smoother;
  };

  /// The nodes that P has a part in.
  void list_free_nodes() {
    GridNodes<S> const& nodes = fine_->nodes();
    std::size_t const n = static_cast<std::size_t>(nodes.leaves.count);
    grow(mask_, host_mask_, "free_mask", n);
    grow(origin_, host_origin_, "free_origin", n);
    if (fine_->fixed().extent(0) > 0) {
      for_each<S>("free_nodes", nodes.leaves.count,
                  kernels::FreeNodes<S>{nodes, fine_->fixed(), mask_});
      S::instance().fence("taut: free nodes");
      copy_front<S>(mask_, host_mask_, n);
    } else {
      copy_front<S>(nodes.mask, host_mask_, n);
    }
    copy_front<S>(nodes.leaves.origin, host_origin_, n);
    free_.clear();
    for (std::size_t l = 0; l < n; ++l) {
      free_.origin.push_back({host_origin_(l, 0), host_origin_(l, 1), host_origin_(l, 2)});
      LeafMask& mask = free_.mask.emplace_back();
      for (int x = 0; x < 8; ++x) mask[x] = host_mask_(l, x);
    }
  }

  /// One more level, unless there are enough.
  bool add_level(LeafList const& finer, double dx) {
    int const above = report_.nodes.back();
    if (static_cast<int>(report_.nodes.size()) >= params_.max_levels) return false;
    if (used_ > 0 && above <= std::max(params_.direct_nodes, params_.sparse_nodes)) return false;
    if (used_ == levels_.size()) levels_.emplace_back();
    Level& l = levels_[used_];
    if (source_ != nullptr) {
      source_->make(static_cast<int>(used_), l.level);
    } else {
      l.grid.coarsen(finer, Embedding::radius, dx);
    }
    int const count = source_ != nullptr ? l.level.size() : l.grid.nodes().count;
    // Far-off crumbs of a few nodes stay as many on every level.
    if (count == 0 || (used_ > 0 && 10 * count > 9 * above)) return false;
    if (source_ == nullptr) l.level.resize(l.grid.nodes());
    if (source_ == nullptr && used_ == 0) {
      fine_->template coarse_matrix<Embedding>(l.level.matrix());
    } else if (source_ == nullptr) {
      levels_[used_ - 1].level.template coarse_matrix<Embedding>(l.level.matrix());
    }
    l.level.finish();
    l.vectors.resize(count);
    if (params_.visits > 1) grow(l.before, "level_vector", static_cast<std::size_t>(count));
    l.smoother = Smoother(params_.smoother);
    l.smoother.setup(l.level, l.vectors);
    ++used_;
    report_.nodes.push_back(count);
    return true;
  }

  void invert_coarsest() {
    MatrixLevel<S, T, radius> const& level = levels_[used_ - 1].level;
    int const n = level.size();
    sparse_ = n > params_.direct_nodes && n <= params_.sparse_nodes && factorize_coarsest();
    report_.direct = sparse_ || n <= params_.direct_nodes;
    if (sparse_) return;
    if (!report_.direct) {
      grow(levels_[used_ - 1].before, "level_vector", static_cast<std::size_t>(n));
      return;
    }
    Kokkos::View<double**, Kokkos::LayoutRight, typename S::memory> const dense("coarsest", 3 * n,
                                                                                3 * n);
    for_each<S>("coarsest", n, kernels::SpreadRow<S, T, radius>{level.matrix(), dense});
    S::instance().fence("taut: coarsest level");
    auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), dense);
    std::vector<double> numbers(host.data(), host.data() + host.size());
    // What rounding the blocks of a row does to its sum: some ten units in the last place.
    report_.shift =
        inverse_.factorize(std::move(numbers), n, 16 * double(std::numeric_limits<T>::epsilon()));
  }

  /// False if the matrix is not positive definite to the precision of T.
  bool factorize_coarsest() {
    MatrixLevel<S, T, radius> const& level = levels_[used_ - 1].level;
    grow(all_, "coarsest_nodes", static_cast<std::size_t>(level.size()));
    for_each<S>("coarsest_nodes", level.size(), kernels::NumberAll<S>{all_});
    bool const positive = exact_.factorize(level.matrix(), all_, level.size(), false,
                                           16 * double(std::numeric_limits<T>::epsilon()));
    report_.shift = exact_.shift();
    report_.memory += exact_.memory();
    return positive;
  }

  bool solves_by_pcg() const {
    return used_ > 0 && !report_.direct && params_.coarse_tolerance > 0;
  }
  /// What the residual of the coarsest level has to come down to, from a right-hand side of it.
  double enough_of(VectorField<T, S> const& b) const {
    Level const& last = levels_[used_ - 1];
    double const asked = params_.coarse_tolerance * params_.coarse_tolerance;
    return asked * jacobi_form(last.level, b, last.vectors.reducer);
  }
  double enough_unsmoothed() const {
    bring_down(*fine_, fine_vectors_.b, levels_[0].level, levels_[0].unsmoothed);
    for (std::size_t l = 1; l < used_; ++l) {
      bring_down(levels_[l - 1].level, levels_[l - 1].unsmoothed, levels_[l].level,
                 levels_[l].unsmoothed);
    }
    return enough_of(levels_[used_ - 1].unsmoothed);
  }

  template <class Finer, class TF>
  static void bring_down(Finer const& finer, VectorField<TF, S> const& from,
                         MatrixLevel<S, T, radius> const& coarser, VectorField<T, S> const& to) {
    restrict_to<Embedding>(finer.nodes(), finer.fixed(), from, coarser.nodes(), to);
    if (coarser.fixed().extent(0) > 0) {
      for_each<S>("clear_fixed", coarser.size(), kernels::ClearFixed<S, T>{coarser.fixed(), to});
    }
  }

  /// From fine_vectors_.b to fine_vectors_.x.
  void cycle() const {
    auto const& v = fine_vectors_;
    if (solves_by_pcg() && !params_.coarse_by_own) enough_ = enough_unsmoothed();
    fine_smoother_.first(*fine_, v);
    if (used_ > 0) {
      Level const& below = levels_[0];
      bring_down(*fine_, v.r, below.level, below.vectors.b);
      visit(0);
      add_prolonged<Embedding>(below.level.nodes(), below.vectors.x, fine_->nodes(), fine_->fixed(),
                               v.x);
    }
    fine_smoother_.second(*fine_, v);
  }

  /// From b to x of level l, by as many cycles as asked for.
  void visit(std::size_t l) const {
    Level const& level = levels_[l];
    bool const exact = l + 1 == used_ && (report_.direct || solves_by_pcg());
    int const visits = exact ? 1 : l + 1 == used_ ? params_.coarse_sweeps : params_.visits;
    auto const& v = level.vectors;
    int const n = level.level.size();
    for (int k = 0; k < visits; ++k) {
      if (k > 0) {
        // x = x + cycle (b - A x); the cycle starts from its own b.
        level.level.residual(v.b, v.x, v.r);
        for_each<S>("cycle_keep", n, kernels::ConvertVectors<S, T, T>{v.r, v.b});
        if (k == 1) {
          for_each<S>("cycle_keep", n, kernels::ConvertVectors<S, T, T>{v.x, level.before});
        } else {
          for_each<S>("cycle_add", n, kernels::AddVectors<S, T>{v.x, level.before});
        }
      }
      once(l);
    }
    if (visits > 1) for_each<S>("cycle_add", n, kernels::AddVectors<S, T>{level.before, v.x});
  }

  void once(std::size_t l) const {
    Level const& level = levels_[l];
    auto const& v = level.vectors;
    if (l + 1 == used_ && sparse_) return exact_.solve(v.b, v.x, level.level.size(), false);
    if (l + 1 == used_ && report_.direct) {
      inverse_.apply(v.b, v.x);
      return;
    }
    if (l + 1 == used_ && solves_by_pcg()) {
      if (params_.coarse_by_own) enough_ = enough_of(v.b);
      coarse_count_ += solve_by_pcg(level.level, v, {enough_, params_.coarse_iterations});
      return;
    }
    level.smoother.first(level.level, v);
    if (l + 1 < used_) {
      Level const& below = levels_[l + 1];
      bring_down(level.level, v.r, below.level, below.vectors.b);
      visit(l + 1);
      add_prolonged<Embedding>(below.level.nodes(), below.vectors.x, level.level.nodes(),
                               level.level.fixed(), v.x);
    }
    level.smoother.second(level.level, v);
  }

  Params params_;
  Fine const* fine_ = nullptr;
  FineSmoother fine_smoother_;
  LevelVectors<FineScalar, S> fine_vectors_;
  std::deque<Level> levels_;  ///< below the fine one; the first `used_` of them
  std::size_t used_ = 0;
  Source* source_ = nullptr;
  DenseInverse<S> inverse_;
  bool sparse_ = false;  ///< the coarsest level is solved by exact_
  ExactBlock<S> exact_;
  kernels::NodeIndices<S> all_;
  mutable double enough_ = 0;  ///< of this cycle
  mutable int coarse_count_ = 0;
  MultigridReport report_;

  LeafList free_;
  typename GridNodes<S>::template PerLeaf<std::uint64_t* [8]> mask_;
  typename decltype(mask_)::HostMirror host_mask_;
  typename GridNodes<S>::template PerLeaf<int* [3]> origin_;
  typename decltype(origin_)::HostMirror host_origin_;
};

}  // namespace taut
