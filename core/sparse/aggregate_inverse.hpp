// Dense inverses of the diagonal blocks of a matrix that belong to runs of consecutive unknowns
// ("aggregates"), stored as G = L^-1 of A_k = L L', so that z = G'(G r) has r.z = |G r|^2 >= 0 in
// any precision.
//
// G is made row by row by the bordering method: with G of the leading rows known and a the next row
// of A_k, l = G a, pivot = a_ii - l.l, and the next row of G is [-l'G, 1] / sqrt(pivot). So the
// factor is made by the same two loops, products with G and with G', that apply it.
//
// One team per aggregate; each number is summed by one thread in a fixed order, so the result does
// not depend on the size of the team.
#pragma once

#include <taut/core/exec/parallel.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/sparse/block_csr.hpp>

#include <cstddef>

namespace taut {
namespace kernels {

/// A lower triangle by rows, each padded with zeros to whole groups of 8, so that the inner loops
/// have a fixed length that the compiler vectorises.
struct PackedTriangle {
  static constexpr int group = 8;

  /// Numbers in row i, padding included.
  KOKKOS_FORCEINLINE_FUNCTION static int length(int i) { return group * (i / group + 1); }
  /// Where row i begins; for i = rows, a multiple of the group, the numbers stored in all.
  KOKKOS_FORCEINLINE_FUNCTION static int row(int i) {
    int const full = i / group;
    return group * group * full * (full + 1) / 2 + (i % group) * length(i);
  }

  /// sum_j a_j b_j over whole groups, in eight interleaved sums.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static T dot(T const* a, T const* b, int length) {
    T sum[group] = {};
    for (int j = 0; j < length; j += group)
      for (int k = 0; k < group; ++k) sum[k] += a[j + k] * b[j + k];
    return ((sum[0] + sum[1]) + (sum[2] + sum[3])) + ((sum[4] + sum[5]) + (sum[6] + sum[7]));
  }

  /// sum[k] = sum_i y_i G(i, first + k) for the rows up to `rows`, for one group of columns.
  template <class T>
  KOKKOS_FORCEINLINE_FUNCTION static void transposed(T const* g, T const* y, int first, int rows,
                                                     T (&sum)[group]) {
    for (int k = 0; k < group; ++k) sum[k] = 0;
    T const* from = g + row(first) + first;
    for (int i = first; i < rows; from += length(i), ++i)
      for (int k = 0; k < group; ++k) sum[k] += y[i] * from[k];
  }
};

/// The lower triangle of the block of an aggregate in a matrix; rows beyond the last unknown are
/// those of the identity.
template <class S>
struct LoadAggregate {
  using Triangle = PackedTriangle;
  BlockCsr<S, double> a;
  int run;

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team, double* g) const {
    int const first = run * team.league_rank();
    int const last = Kokkos::min(first + run, a.rows());
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, run), [&](int v) {
      if (first + v >= last) {
        for (int i = 3 * v; i < 3 * v + 3; ++i) g[Triangle::row(i) + i] = 1;
        return;
      }
      for (int k = a.row_begin(first + v); k < a.row_begin(first + v + 1); ++k) {
        int const w = a.column(k) - first;
        if (w < 0 || w > v) continue;
        for (int r = 0; r < 3; ++r)
          for (int c = 0; c < 3 && 3 * w + c <= 3 * v + r; ++c)
            g[Triangle::row(3 * v + r) + 3 * w + c] = a.block(k)(r, c);
      }
    });
  }
};

/// `Load` writes the lower triangle of an aggregate into zeros.
template <class S, class Storage, class Load>
struct FactorAggregate {
  using Triangle = PackedTriangle;
  /// Below this fraction of the diagonal a pivot is noise: the block is not positive definite. Its
  /// row is then cut off from the rows before it and left to its own diagonal, as point Jacobi
  /// would; with the coupling kept, G could grow without bound.
  static constexpr double least_pivot = 1e-12;

  Load load;
  Kokkos::View<Storage*, typename S::memory> factor;
  int run, scratch_level;

  KOKKOS_FUNCTION std::size_t scratch_size() const {
    return sizeof(double) * std::size_t(Triangle::row(3 * run) + 3 * run);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team, int& floored) const {
    int const rows = 3 * run;
    double* const g =
        static_cast<double*>(team.team_scratch(scratch_level).get_shmem(int(scratch_size())));
    double* const l = g + Triangle::row(rows);
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, Triangle::row(rows)),
                         [&](int t) { g[t] = 0; });
    team.team_barrier();
    load(team, g);
    team.team_barrier();

    for (int i = 0; i < rows; ++i) {
      double* const row = g + Triangle::row(i);
      Kokkos::parallel_for(Kokkos::TeamThreadRange(team, i), [&](int j) {
        l[j] = Triangle::dot(g + Triangle::row(j), row, Triangle::length(j));
      });
      team.team_barrier();
      double const diagonal = row[i];
      double pivot = diagonal;
      for (int j = 0; j < i; ++j) pivot -= l[j] * l[j];
      bool const replaced = !(pivot > least_pivot * diagonal);
      if (replaced) pivot = diagonal != 0 ? Kokkos::abs(diagonal) : 1;
      if (replaced && team.team_rank() == 0) ++floored;
      double const scale = 1 / Kokkos::sqrt(pivot);
      team.team_barrier();
      int const groups = Triangle::length(i) / Triangle::group;
      Kokkos::parallel_for(Kokkos::TeamThreadRange(team, groups), [&](int q) {
        double sum[Triangle::group];
        int const column = Triangle::group * q;
        Triangle::transposed(g, l, column, i, sum);
        for (int k = 0; k < Triangle::group; ++k) row[column + k] = replaced ? 0 : -scale * sum[k];
        if (q == groups - 1) row[i] = scale;
      });
      team.team_barrier();
    }

    int const size = Triangle::row(rows);
    std::size_t const offset = std::size_t(size) * team.league_rank();
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, size),
                         [&](int t) { factor(offset + t) = Storage(g[t]); });
  }
};

template <class S, class Storage, class R>
struct ApplyAggregate {
  using Triangle = PackedTriangle;

  Kokkos::View<Storage const*, typename S::memory> factor;
  VectorField<R, S> r, z;
  int run;
  Storage scale = 1;
  bool add = false;

  KOKKOS_FUNCTION std::size_t scratch_size() const {
    return sizeof(Storage) * std::size_t(6 * run);
  }

  KOKKOS_FUNCTION void operator()(typename S::team_member const& team) const {
    int const rows = 3 * run, first = run * team.league_rank();
    int const own = 3 * Kokkos::min(run, int(r.extent(0)) - first);
    Storage* const x = static_cast<Storage*>(team.team_scratch(0).get_shmem(int(scratch_size())));
    Storage* const y = x + rows;
    Storage const* const g = factor.data() + std::size_t(Triangle::row(rows)) * team.league_rank();

    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, rows), [&](int t) {
      x[t] = t < own ? Storage(r(first + t / 3, t % 3)) : Storage(0);
    });
    team.team_barrier();
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, rows), [&](int i) {
      y[i] = Triangle::dot(g + Triangle::row(i), x, Triangle::length(i));
    });
    team.team_barrier();
    Kokkos::parallel_for(Kokkos::TeamThreadRange(team, rows / Triangle::group), [&](int q) {
      Storage sum[Triangle::group];
      int const column = Triangle::group * q;
      Triangle::transposed(g, y, column, rows, sum);
      for (int k = 0; k < Triangle::group; ++k) {
        int const t = column + k;
        if (t >= own) continue;
        R& to = z(first + t / 3, t % 3);
        to = (add ? to : R(0)) + R(scale * sum[k]);
      }
    });
  }
};

}  // namespace kernels

/// The inverses of the aggregates of `run` unknowns (a multiple of 8) of a matrix. `team` is the
/// number of threads per aggregate, 0 for Kokkos' choice.
template <class S, class Storage = float>
class AggregateInverse {
public:
  AggregateInverse() = default;
  explicit AggregateInverse(int unknowns, int run = 32, int team = 0)
      : unknowns_(unknowns), run_(run), count_((unknowns + run - 1) / run), team_(team) {
    check_run(run);
    factor_ = Kokkos::View<Storage*, typename S::memory>(
        "aggregate_inverse", std::size_t(kernels::PackedTriangle::row(3 * run)) * count_);
  }

  /// Throws Error unless the kernels can hold aggregates of that many.
  static void check_run(int run) {
    if (run >= 8 && run % 8 == 0) return;
    throw Error("Schwarz: aggregates of {} unknowns; take 8, 16, 24 or 32", run);
  }

  /// Inverts the diagonal blocks of A, of which the lower triangle is read; returns how many pivots
  /// were not positive and were replaced.
  int factorize(BlockCsr<S, double> const& a) {
    return factorize_loaded(kernels::LoadAggregate<S>{a, run_});
  }
  /// The same of blocks that `load(team, g)` writes: the lower triangle of that of
  /// team.league_rank(), as a PackedTriangle.
  template <class Load>
  int factorize_loaded(Load const& load) {
    kernels::FactorAggregate<S, Storage, Load> kernel{load, factor_, run_, 0};
    using Policy = typename S::team_policy;
    int const bytes = static_cast<int>(kernel.scratch_size());
    kernel.scratch_level = kernels::scratch_level(bytes, Policy::scratch_size_max(0));
    int floored = 0;
    Kokkos::parallel_reduce(label("schwarz_factor"),
                            policy().set_scratch_size(kernel.scratch_level, Kokkos::PerTeam(bytes)),
                            kernel, floored);
    return floored;
  }

  /// z = scale times the block-diagonal inverse times r, or z += the same. Allocates nothing.
  template <class R>
  void apply(VectorField<R, S> const& r, VectorField<R, S> const& z, double scale = 1,
             bool add = false) const {
    kernels::ApplyAggregate<S, Storage, R> const kernel{factor_, r, z, run_, Storage(scale), add};
    int const bytes = static_cast<int>(kernel.scratch_size());
    Kokkos::parallel_for(label("schwarz_apply"),
                         policy().set_scratch_size(0, Kokkos::PerTeam(bytes)), kernel);
  }

  int unknowns() const { return unknowns_; }
  int aggregates() const { return count_; }
  std::size_t memory() const { return factor_.span() * sizeof(Storage); }

private:
  typename S::team_policy policy() const {
    if (team_ > 0) return typename S::team_policy(S::instance(), count_, team_);
    return typename S::team_policy(S::instance(), count_, Kokkos::AUTO);
  }

  int unknowns_ = 0, run_ = 0, count_ = 0, team_ = 0;
  Kokkos::View<Storage*, typename S::memory> factor_;
};

}  // namespace taut
