// Block matrices to test on, and a plain serial reading of them.
#pragma once

#include <taut/core/sparse/block_csr.hpp>

#include <array>
#include <random>
#include <vector>

namespace taut::test {

/// Where unknown (i, j, k) of a lattice stands in the order of Morton, which keeps neighbours
/// close.
inline int morton(int i, int j, int k) {
  int number = 0;
  for (int bit = 0; bit < 10; ++bit)
    number |= ((i >> bit & 1) | (j >> bit & 1) << 1 | (k >> bit & 1) << 2) << 3 * bit;
  return number;
}

/// Pairs of neighbours in an n x n x n lattice of unknowns: in Morton's order where n is a power of
/// two, numbered i + n (j + n k) otherwise.
inline std::vector<int> lattice_edges(int n) {
  auto const number = [n](int i, int j, int k) {
    return (n & (n - 1)) == 0 ? morton(i, j, k) : i + n * (j + n * k);
  };
  std::vector<int> edges;
  for (int k = 0; k < n; ++k) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        int const v = number(i, j, k);
        if (i + 1 < n) edges.insert(edges.end(), {v, number(i + 1, j, k)});
        if (j + 1 < n) edges.insert(edges.end(), {v, number(i, j + 1, k)});
        if (k + 1 < n) edges.insert(edges.end(), {v, number(i, j, k + 1)});
      }
    }
  }
  return edges;
}

/// G G' + shift I of a random G.
inline Mat3<double> random_spd(std::mt19937& random, double shift) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  Mat3<double> g;
  for (double& entry : g.a) entry = uniform(random);
  Mat3<double> spd = g * transpose(g);
  for (int c = 0; c < 3; ++c) spd(c, c) += shift;
  return spd;
}

/// A vector Laplacian of the lattice with a random stiffness B per edge, [B, -B; -B, B], and `mass`
/// on the diagonal: positive definite for mass > 0, singular (translations) for mass = 0.
template <class S>
BlockCsr<S> lattice_matrix(int n, double mass) {
  std::vector<int> const edges = lattice_edges(n);
  Connectivity const kind{edges, 2};
  BlockCsr<SerialSpace> host(pattern_from_elements(n * n * n, {&kind, 1}));
  std::mt19937 random(7);
  for (std::size_t e = 0; e < edges.size(); e += 2) {
    Mat3<double> const b = random_spd(random, 0.5);
    for (int const i : {edges[e], edges[e + 1]})
      for (int const j : {edges[e], edges[e + 1]}) host.add(i, j, (i == j ? 1.0 : -1.0) * b);
  }
  for (int i = 0; i < host.rows(); ++i) host.add(i, i, mass * identity3<double>());

  BlockCsr<S> matrix(pattern_from_elements(n * n * n, {&kind, 1}));
  assign(matrix.block, host.block);
  return matrix;
}

/// A field of random numbers in (-1, 1): the same for every space and layout.
template <class R, class S>
VectorField<R, S> random_field(int n, unsigned seed) {
  VectorField<R, S> const field("random_field", n);
  auto const host = Kokkos::create_mirror_view(field);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) host(i, c) = R(uniform(random));
  assign(field, host);
  return field;
}

/// The numbers of a field, unknown by unknown.
template <class Field>
std::vector<double> numbers(Field const& field) {
  auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
  std::vector<double> result;
  for (std::size_t i = 0; i < host.extent(0); ++i)
    for (std::size_t c = 0; c < host.extent(1); ++c) result.push_back(host(i, c));
  return result;
}

using Dense = std::vector<std::vector<double>>;

/// The matrix as 3n rows of 3n numbers.
inline Dense dense(BlockCsr<SerialSpace> const& a) {
  Dense full(3 * a.rows(), std::vector<double>(3 * a.rows(), 0.0));
  for (int i = 0; i < a.rows(); ++i)
    for (int k = a.row_begin(i); k < a.row_begin(i + 1); ++k)
      for (int m = 0; m < 9; ++m) full[3 * i + m % 3][3 * a.column(k) + m / 3] = a.block(k).a[m];
  return full;
}

/// A^-1 b by Gaussian elimination with partial pivoting.
inline std::vector<double> dense_solve(Dense a, std::vector<double> b) {
  std::size_t const n = b.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < n; ++i)
      if (std::abs(a[i][k]) > std::abs(a[pivot][k])) pivot = i;
    std::swap(a[k], a[pivot]);
    std::swap(b[k], b[pivot]);
    for (std::size_t i = k + 1; i < n; ++i) {
      double const factor = a[i][k] / a[k][k];
      if (factor == 0) continue;
      for (std::size_t j = k; j < n; ++j) a[i][j] -= factor * a[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
  return b;
}

/// max |a - b| / max |b|
inline double relative_difference(std::vector<double> const& a, std::vector<double> const& b) {
  double difference = 0, largest = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference = std::max(difference, std::abs(a.at(i) - b[i]));
    largest = std::max(largest, std::abs(b[i]));
  }
  return difference / largest;
}

}  // namespace taut::test
