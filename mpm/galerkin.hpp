// The coarse matrix A_c = P'AP of an embedding (embedding.hpp). Everything is a product over the
// axes, so no pattern is searched for: with fine rows 2I + a and offsets d,
//
//   B_I(a + d) = sum_a w(a) A(2I + a, d),      A_c(I, D) = sum_e w(e - 2D) B_I(e),
//
// and the second sum goes one axis at a time. Rows of fixed nodes have no part in P; their columns
// must have been cut off (cut_off_fixed). Linear embedding turns stencils of radius 1 to 3 into
// such of radius 2 or less, quadratic into such of radius 3 or less.
#pragma once

#include <taut/mpm/embedding.hpp>
#include <taut/mpm/grid_matrix.hpp>

namespace taut {
namespace kernels {

/// One coarse row, for hosts: dense sums on the stack.
template <class S, class Embedding, class TF, int RF, class TC, int RC>
struct GalerkinSums {
  static constexpr int r = Embedding::radius;
  static_assert((RF + 2 * r) / 2 <= RC, "the coarse stencil is too narrow for this embedding");
  using Fine = StencilRow<RF>;
  using Coarse = StencilRow<RC>;
  static constexpr int reach = RF + r, width = 2 * reach + 1;  ///< of B
  static constexpr int length = 3 * 2 * r + Fine::padded;      ///< of its runs

  GridMatrix<S, TF, RF> fine;
  GridMatrix<S, TC, RC> coarse;
  FixedNodes<S> fixed;

  KOKKOS_FUNCTION static TC weight(int d) { return TC(Embedding::weight(d)); }

  [[gnu::noinline]] KOKKOS_FUNCTION void operator()(int i) const {
    TC b[width][width][3][length] = {};
    add_rows(i, b);
    // Along z, then y, then x.
    TC bz[width][width][3][Coarse::padded] = {};
    for (int x = 0; x < width; ++x)
      for (int y = 0; y < width; ++y)
        for (int row = 0; row < 3; ++row) contract_run(b[x][y][row], bz[x][y][row]);
    TC by[width][Coarse::width][3][Coarse::padded] = {};
    for (int D = -RC; D <= RC; ++D)
      for (int e = Kokkos::max(2 * D - r, -reach); e <= Kokkos::min(2 * D + r, reach); ++e)
        for (int x = 0; x < width; ++x) {
          add(weight(e - 2 * D), bz[x][e + reach][0], by[x][D + RC][0]);
        }
    for (int D = -RC; D <= RC; ++D) {
      TC bx[Coarse::width][3][Coarse::padded] = {};
      for (int e = Kokkos::max(2 * D - r, -reach); e <= Kokkos::min(2 * D + r, reach); ++e)
        for (int y = 0; y < Coarse::width; ++y)
          add(weight(e - 2 * D), by[e + reach][y][0], bx[y][0]);
      int const first = Coarse::place(D, -RC, -RC, 0, 0);
      constexpr int numbers = Coarse::width * 3 * Coarse::padded;
      TC const* const from = &bx[0][0][0];
      for (int k = 0; k < numbers; ++k) coarse.entry(i, first + k) = from[k];
    }
  }

private:
  /// The three padded rows of a run.
  KOKKOS_FORCEINLINE_FUNCTION static void add(TC w, TC const* from, TC* to) {
    for (int k = 0; k < 3 * Coarse::padded; ++k) to[k] += w * from[k];
  }
  KOKKOS_FORCEINLINE_FUNCTION static void contract_run(TC const* from, TC* to) {
    for (int D = -RC; D <= RC; ++D)
      for (int e = Kokkos::max(2 * D - r, -reach); e <= Kokkos::min(2 * D + r, reach); ++e)
        for (int c = 0; c < 3; ++c) {
          to[3 * (D + RC) + c] += weight(e - 2 * D) * from[3 * (e + reach) + c];
        }
  }
  /// b(a + d) += w(a) A(2I + a, d) over all fine rows.
  KOKKOS_FORCEINLINE_FUNCTION void add_rows(int i, TC (&b)[width][width][3][length]) const {
    int const x = 2 * coarse.nodes.ijk(i, 0), y = 2 * coarse.nodes.ijk(i, 1),
              z = 2 * coarse.nodes.ijk(i, 2);
    for (int ax = -r; ax <= r; ++ax)
      for (int ay = -r; ay <= r; ++ay)
        for (int az = -r; az <= r; ++az) {
          int const f = fine.nodes.node(x + ax, y + ay, z + az);
          if (f < 0 || is_fixed<S>(fixed, f)) continue;
          TC const w = weight(ax) * weight(ay) * weight(az);
          for (int u = 0; u < Fine::width; ++u)
            for (int v = 0; v < Fine::width; ++v) {
              int const first = Fine::place(u - RF, v - RF, -RF, 0, 0);
              for (int row = 0; row < 3; ++row) {
                TC* const to = b[ax + r + u][ay + r + v][row] + 3 * (az + r);
                for (int k = 0; k < Fine::padded; ++k) {
                  to[k] += w * TC(fine.entry(f, first + row * Fine::padded + k));
                }
              }
            }
        }
  }
};

/// One coarse row block by block, for devices, where the sums above would not stay in registers.
template <class S, class Embedding, class TF, int RF, class TC, int RC>
struct GalerkinBlocks {
  static constexpr int r = Embedding::radius;
  GridMatrix<S, TF, RF> fine;
  GridMatrix<S, TC, RC> coarse;
  FixedNodes<S> fixed;

  KOKKOS_FUNCTION void operator()(int t) const {
    using Row = StencilRow<RC>;
    int const i = t / Row::runs, run = t % Row::runs;
    int const D[2] = {run / Row::width - RC, run % Row::width - RC};
    for (int row = 0; row < 3; ++row)
      for (int k = 3 * Row::width; k < Row::padded; ++k)
        coarse.entry(i, Row::place(D[0], D[1], -RC, row, 0) + k) = 0;
    for (int Dz = -RC; Dz <= RC; ++Dz) coarse.set(i, D[0], D[1], Dz, block(i, D[0], D[1], Dz));
  }
  [[gnu::noinline]] KOKKOS_FUNCTION Mat3<TC> block(int i, int Dx, int Dy, int Dz) const {
    Mat3<TC> total{};
    int const x = 2 * coarse.nodes.ijk(i, 0), y = 2 * coarse.nodes.ijk(i, 1),
              z = 2 * coarse.nodes.ijk(i, 2);
    for (int ax = -r; ax <= r; ++ax)
      for (int ay = -r; ay <= r; ++ay)
        for (int az = -r; az <= r; ++az) {
          int const f = fine.nodes.node(x + ax, y + ay, z + az);
          if (f < 0 || is_fixed<S>(fixed, f)) continue;
          double const w = Embedding::weight(ax) * Embedding::weight(ay) * Embedding::weight(az);
          // d = 2D + b - a with |b| <= r and |d| <= RF.
          for (int dx = low(2 * Dx - ax); dx <= high(2 * Dx - ax); ++dx)
            for (int dy = low(2 * Dy - ay); dy <= high(2 * Dy - ay); ++dy)
              for (int dz = low(2 * Dz - az); dz <= high(2 * Dz - az); ++dz) {
                TC const v =
                    TC(w * Embedding::weight(dx + ax - 2 * Dx) *
                       Embedding::weight(dy + ay - 2 * Dy) * Embedding::weight(dz + az - 2 * Dz));
                Mat3<TF> const b = fine.block(f, dx, dy, dz);
                for (int m = 0; m < 9; ++m) total.a[m] += v * TC(b.a[m]);
              }
        }
    return total;
  }

private:
  KOKKOS_FORCEINLINE_FUNCTION static int low(int d) { return Kokkos::max(d - r, -RF); }
  KOKKOS_FORCEINLINE_FUNCTION static int high(int d) { return Kokkos::min(d + r, RF); }
};

}  // namespace kernels

/// `coarse`, which has its nodes already, becomes P' fine P.
template <class Embedding, class S, class TF, int RF, class TC, int RC>
void galerkin(GridMatrix<S, TF, RF> const& fine, FixedNodes<S> const& fixed,
              GridMatrix<S, TC, RC> const& coarse) {
  if constexpr (S::on_host) {
    for_each<S>("galerkin", coarse.size(),
                kernels::GalerkinSums<S, Embedding, TF, RF, TC, RC>{fine, coarse, fixed});
  } else {
    for_each<S>("galerkin", coarse.size() * StencilRow<RC>::runs,
                kernels::GalerkinBlocks<S, Embedding, TF, RF, TC, RC>{fine, coarse, fixed});
  }
}

}  // namespace taut
