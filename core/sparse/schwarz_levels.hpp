// A symmetric cycle over the levels of smoothed aggregation, with the dense inverses of runs of
// unknowns ("aggregates", L) as smoother:
//   z = w L r,   z += P coarse(P' (r - A z)),   z += w L (r - A z),
// where the coarse levels do the same and the last one is factored on the host; or, additively,
//   z = L r + P coarse(P' r).
//
// w is 1.8 over the largest eigenvalue of L A as Lanczos' method estimates it, mostly from above.
// The cycle is positive definite while that of w L A is below 2, also where A is not quite: it is
//   w L (2 / w L^-1 - A) w L, plus a congruence of the coarse one.
#pragma once

#include <taut/core/sparse/aggregate_inverse.hpp>
#include <taut/core/sparse/direct_solver.hpp>
#include <taut/core/sparse/operations.hpp>
#include <taut/core/sparse/ritz_value.hpp>
#include <taut/core/sparse/smoothed_aggregation.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace taut {
namespace kernels {

/// Numbers in [-1, 1] that follow from the number of an unknown alone, times the root of its
/// diagonal: as much of each stiffness.
template <class S, class T, class R>
struct LanczosStart {
  BlockCsr<S, T> a;
  VectorField<R, S> r;
  KOKKOS_FUNCTION void operator()(int i) const {
    Mat3<T> const& diagonal = a.block(a.find(i, i));
    for (int c = 0; c < 3; ++c) {
      unsigned h = 3u * static_cast<unsigned>(i) + static_cast<unsigned>(c) + 0x9e3779b9u;
      h = (h ^ h >> 16) * 0x7feb352du;
      h = (h ^ h >> 15) * 0x846ca68bu;
      h ^= h >> 16;
      double const root = Kokkos::sqrt(Kokkos::max(double(diagonal(c, c)), 0.0));
      r(i, c) = R(root * (2 * (double(h) / 4294967295.0) - 1));
    }
  }
};

/// y += s x
template <class S, class R>
struct AddScaledField {
  VectorField<R, S> x, y;
  double s;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) y(i, c) += R(s * double(x(i, c)));
  }
};

/// d = z + s d
template <class S, class R>
struct TurnField {
  VectorField<R, S> z, d;
  double s;
  KOKKOS_FUNCTION void operator()(int i) const {
    for (int c = 0; c < 3; ++c) d(i, c) = R(double(z(i, c)) + s * double(d(i, c)));
  }
};

template <class S, class R>
struct FieldProduct {
  VectorField<R, S> a, b;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, 1>& sums) const {
    for (int c = 0; c < 3; ++c) sums[0] += double(a(i, c)) * double(b(i, c));
  }
};

}  // namespace kernels

/// `Storage` is the scalar of the matrices of the cycle, `R` that of the vectors on the finest
/// level; those on others are in fp64.
template <class S, class Storage, class R>
class SchwarzLevels {
public:
  using Vectors = VectorField<R, S>;

  struct Params {
    int aggregate = 32;          ///< unknowns per aggregate: 8, 16, 24 or 32
    int team = 0;                ///< threads per aggregate; 0: Kokkos chooses
    bool multiplicative = true;  ///< on the finest level
    int run = 16;                ///< unknowns that move as one body on the next level; even
    /// Unknowns of a level that is factored; four times as many where runs cannot be joined
    int max_direct = 256;
    int max_levels = 10;  ///< of which the last is factored, however large; 1: no coarse level
  };

  SchwarzLevels() = default;
  explicit SchwarzLevels(Params const& params) : params_(params) {
    AggregateInverse<S, Storage>::check_run(params.aggregate);
  }

  /// From A. `x`: positions, for motions that turn; empty: runs are translated. `of`: the body of
  /// each unknown, which runs keep to; of another length: not known. `shift`: see Aggregation.
  /// Allocates.
  template <class X>
  void update(BlockCsr<S, double> const& a, double shift, VectorField<X, S> const& x,
              std::vector<int> of) {
    int const n = a.rows();
    // Inverses of as many unknowns are written over those of the last update.
    std::vector<AggregateInverse<S, Storage>> before;
    for (Level& level : levels_) before.push_back(std::move(level.local));
    levels_.clear();
    solvable_ = smooths_last_ = false;
    add_level(a, before);
    if (levels_[0].local.aggregates() <= 1 || params_.max_levels <= 1) return;
    if (residual_.extent_int(0) != n) residual_ = Vectors("cycle_residual", n);

    if (static_cast<int>(of.size()) != n) of.clear();
    BlockCsr<S, double> matrix = a;
    FreeMotions<S> motions = rigid_motions(a, x);
    RunBegins begin = runs(n, 1, of);
    for (;;) {
      Aggregation<S> const next(matrix, begin, motions, shift);
      levels_.back().p = copy_as<Storage>(next.p);
      matrix = next.coarse;
      motions = next.motions;
      of = bodies_of_runs(begin, of);
      int const rows = matrix.rows(), depth = static_cast<int>(levels_.size()) + 1;
      CoarseVectors& coarse = vectors_of(levels_.size(), rows);
      begin = runs(rows, 2, of);
      bool const small = rows <= params_.max_direct || depth >= params_.max_levels;
      bool const joins = 4 * (static_cast<int>(begin.size()) - 1) <= rows;
      if (small || (!joins && rows <= 4 * params_.max_direct)) {
        solvable_ = direct_.factorize(matrix) == Definiteness::positive;
        numbers_.resize(3 * std::size_t(rows));
        host_ = Kokkos::create_mirror_view(coarse.r);
        break;
      }
      add_level(matrix, before);
      if (joins) continue;
      // Runs keep to bodies, so that what does not touch stays apart. Bodies beyond number that are
      // one run each see their neighbours.
      solvable_ = smooths_last_ = true;
      break;
    }
    std::size_t const cycles = levels_.size() - (smooths_last_ ? 1 : 0);
    for (std::size_t l = params_.multiplicative ? 0 : 1; l < cycles && solvable_; ++l) {
      solvable_ = set_damping(l);
    }
    if (solvable_) return;
    levels_.resize(1);
    levels_[0].p = {};
    smooths_last_ = false;
  }

  /// z = M r. Allocates nothing.
  void apply(Vectors const& r, Vectors const& z) const {
    if (!has_coarse_level() || !params_.multiplicative) {
      levels_[0].local.apply(r, z);
      if (has_coarse_level()) correct(0, r, z);
      return;
    }
    cycle(0, r, z, residual_);
  }

  /// False where one aggregate holds all unknowns, on request, and where A is found not to be
  /// positive semi-definite: what is left are its aggregates.
  bool has_coarse_level() const { return solvable_; }
  int levels() const {
    return static_cast<int>(levels_.size()) + (solvable_ && !smooths_last_ ? 1 : 0);
  }
  /// Whether the last level is left to its aggregates.
  bool smooths_last() const { return smooths_last_; }
  /// Unknowns of a level, the factored one included.
  int unknowns(int level) const {
    return level == 0 ? levels_[0].a.rows() : coarse_[level - 1].r.extent_int(0);
  }
  /// Pivots of the aggregates that were not positive and were replaced by the diagonal.
  int floored_pivots() const {
    int floored = 0;
    for (Level const& level : levels_) floored += level.floored_pivots;
    return floored;
  }
  /// What the smoother of a level is multiplied by.
  double damping(int level) const { return levels_[level].damping; }
  /// Bytes held between updates.
  std::size_t memory() const {
    std::size_t bytes =
        residual_.span() * sizeof(R) + direct_.memory() + numbers_.capacity() * sizeof(double);
    for (Level const& level : levels_) {
      bytes += level.local.memory() + level.a.block.span() * sizeof(Mat3<Storage>) +
               (level.a.column.span() + level.a.row_begin.span()) * sizeof(int) +
               level.p.block.span() * sizeof(MotionRows<Storage>) +
               (level.p.row_begin.span() + level.p.column_begin.span() + 3 * level.p.run.span()) *
                   sizeof(int);
    }
    for (CoarseVectors const& v : coarse_) bytes += 3 * v.r.span() * sizeof(double);
    return bytes;
  }

private:
  struct Level {
    BlockCsr<S, Storage> a;
    AggregateInverse<S, Storage> local;
    Prolongation<S, Storage> p;  ///< from the next level
    double damping = 1;
    int floored_pivots = 0;
  };
  struct CoarseVectors {
    VectorField<double, S> r, z, residual;
  };

  void add_level(BlockCsr<S, double> const& a, std::vector<AggregateInverse<S, Storage>>& before) {
    std::size_t const l = levels_.size();
    Level& level = levels_.emplace_back();
    level.a = copy_as<Storage>(a);
    if (l < before.size() && before[l].unknowns() == a.rows()) {
      level.local = std::move(before[l]);
    } else {
      level.local = AggregateInverse<S, Storage>(a.rows(), params_.aggregate, params_.team);
    }
    level.floored_pivots = level.local.factorize(a);
  }
  /// Runs of whole nodes, of one or two unknowns each.
  RunBegins runs(int rows, int rows_per_node, std::vector<int> const& of) const {
    int const nodes = rows / rows_per_node, length = std::max(params_.run / rows_per_node, 2);
    RunBegins begin = of.empty() ? equal_runs(nodes, length) : runs_of_bodies(of, length);
    for (int& first : begin) first *= rows_per_node;
    return begin;
  }
  static std::vector<int> bodies_of_runs(RunBegins const& begin, std::vector<int> const& of) {
    if (of.empty()) return {};
    std::vector<int> of_run;
    int const rows_per_node = begin.back() / static_cast<int>(of.size());
    for (std::size_t r = 0; r + 1 < begin.size(); ++r)
      of_run.push_back(of[begin[r] / rows_per_node]);
    return of_run;
  }
  CoarseVectors& vectors_of(std::size_t level, int rows) {
    if (coarse_.size() < level) coarse_.resize(level);
    CoarseVectors& v = coarse_[level - 1];
    if (v.r.extent_int(0) != rows) {
      v = {VectorField<double, S>("cycle_r", rows), VectorField<double, S>("cycle_z", rows),
           VectorField<double, S>("cycle_residual", rows)};
    }
    return v;
  }

  /// z = the symmetric cycle on this level times r; `rest` is overwritten.
  template <class X>
  void cycle(std::size_t l, VectorField<X, S> const& r, VectorField<X, S> const& z,
             VectorField<X, S> const& rest) const {
    Level const& level = levels_[l];
    if (l + 1 == levels_.size() && smooths_last_) {
      level.local.apply(r, z);
      return;
    }
    level.local.apply(r, z, level.damping);
    residual(level.a, z, r, rest);
    correct(l, rest, z);
    residual(level.a, z, r, rest);
    level.local.apply(rest, z, level.damping, true);
  }
  /// z += P coarse(P' r).
  template <class X>
  void correct(std::size_t l, VectorField<X, S> const& r, VectorField<X, S> const& z) const {
    CoarseVectors const& coarse = coarse_[l];
    restrict_to(levels_[l].p, r, coarse.r);
    if (l + 1 < levels_.size()) {
      cycle(l + 1, coarse.r, coarse.z, coarse.residual);
    } else {
      solve_directly(coarse);
    }
    add_prolonged(levels_[l].p, coarse.z, z);
  }
  void solve_directly(CoarseVectors const& v) const {
    assign(host_, v.r);
    int const n = v.r.extent_int(0);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) numbers_[3 * i + c] = host_(i, c);
    direct_.solve(numbers_, numbers_);
    for (int i = 0; i < n; ++i)
      for (int c = 0; c < 3; ++c) host_(i, c) = numbers_[3 * i + c];
    assign(v.z, host_);
  }

  /// By Lanczos' method, ten steps at most. False where A is not positive, or not finite.
  bool set_damping(std::size_t l) {
    Level& level = levels_[l];
    int const n = level.a.rows();
    VectorField<double, S> const r("lanczos_r", n), z("lanczos_z", n), d("lanczos_d", n),
        ad("lanczos_ad", n);
    Reducer<S> const reducer(n, 1);
    auto const product_of = [&](auto const& a, auto const& b) {
      return reducer.template sum<1>("lanczos_product", n,
                                     kernels::FieldProduct<S, double>{a, b})[0];
    };
    for_each<S>("lanczos_start", n, kernels::LanczosStart<S, Storage, double>{level.a, r});
    level.local.apply(r, z);
    double rho = product_of(r, z), beta = 0;
    double const enough = 1e-12 * rho;  // everything is found
    LanczosByConjugates lanczos;
    RitzValue found;
    for (int k = 0; k < 10; ++k) {
      for_each<S>("lanczos_turn", n, kernels::TurnField<S, double>{z, d, beta});
      product(level.a, d, ad);
      double const form = product_of(d, ad);
      if (!(form > 0)) return false;
      double const alpha = rho / form;
      for_each<S>("lanczos_reduce", n, kernels::AddScaledField<S, double>{ad, r, -alpha});
      level.local.apply(r, z);
      double const next = product_of(r, z);
      if (!std::isfinite(next)) return false;
      beta = next / rho;
      rho = next;
      found = lanczos.add(alpha, beta);
      if (rho <= enough || (k > 0 && found.residual <= 0.05 * found.value)) break;
    }
    level.damping = 1.8 / std::max(found.value + found.residual, 1.0);
    return true;
  }

  Params params_;
  std::vector<Level> levels_;
  std::vector<CoarseVectors> coarse_;
  Vectors residual_;
  DirectSolver direct_;
  bool solvable_ = false, smooths_last_ = false;
  typename VectorField<double, S>::HostMirror host_;
  mutable std::vector<double> numbers_;
};

}  // namespace taut
