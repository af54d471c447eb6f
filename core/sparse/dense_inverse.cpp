#include <taut/core/sparse/dense_inverse.hpp>

#include <algorithm>
#include <cmath>

namespace taut {
namespace {

/// A + shift D = L L' in the lower triangle; false if it is not positive semi-definite. `a` by
/// rows. What depends on the rows before it, to round-off, is cut off and listed.
bool factor(std::vector<double>& a, int n, double shift, std::vector<int>& cut) {
  constexpr double lost = 1e-11;  // of the diagonal; what round-off leaves grows from row to row
  for (int j = 0; j < n; ++j) {
    double* const row_j = &a[std::size_t(n) * j];
    double const diagonal = row_j[j];
    double pivot = diagonal * (1 + shift);
    for (int k = 0; k < j; ++k) pivot -= row_j[k] * row_j[k];
    if (std::abs(pivot) <= lost * diagonal) {
      cut.push_back(j);
      std::fill(row_j, row_j + j, 0.0);
      row_j[j] = 1;
      for (int i = j + 1; i < n; ++i) a[std::size_t(n) * i + j] = 0;
      continue;
    }
    if (!(pivot > 0)) return false;
    double const root = std::sqrt(pivot);
    row_j[j] = root;
    for (int i = j + 1; i < n; ++i) {
      double* const row_i = &a[std::size_t(n) * i];
      double sum = row_i[j];
      for (int k = 0; k < j; ++k) sum -= row_i[k] * row_j[k];
      row_i[j] = sum / root;
    }
  }
  return true;
}

/// From L, the inverse L'^-1 L^-1, both triangles.
void invert_factor(std::vector<double>& a, int n) {
  // G = L^-1, row by row.
  for (int i = 0; i < n; ++i) {
    double* const row = &a[std::size_t(n) * i];
    double const scale = 1 / row[i];
    std::vector<double> g(i + 1, 0.0);
    for (int k = 0; k < i; ++k) {
      double const* const other = &a[std::size_t(n) * k];
      for (int j = 0; j <= k; ++j) g[j] -= row[k] * other[j];
    }
    for (int j = 0; j < i; ++j) row[j] = scale * g[j];
    row[i] = scale;
  }
  std::vector<double> const g = a;
  std::fill(a.begin(), a.end(), 0.0);
  for (int k = 0; k < n; ++k)
    for (int i = 0; i <= k; ++i)
      for (int j = 0; j <= i; ++j)
        a[std::size_t(n) * i + j] += g[std::size_t(n) * k + i] * g[std::size_t(n) * k + j];
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < i; ++j) a[std::size_t(n) * j + i] = a[std::size_t(n) * i + j];
}

}  // namespace

double invert_positive(std::vector<double>& a, int n, double round_off) {
  std::vector<int> cut;
  for (int i = 0; i < n; ++i) {
    double& diagonal = a[std::size_t(n) * i + i];
    if (diagonal > 0 && std::isfinite(diagonal)) continue;
    cut.push_back(i);
    for (int j = 0; j < n; ++j) a[std::size_t(n) * i + j] = a[std::size_t(n) * j + i] = 0;
    diagonal = 1;
  }
  std::vector<double> const original = a;
  std::vector<int> const without_diagonal = cut;
  double shift = 0;
  while (!factor(a, n, shift, cut)) {
    a = original;
    cut = without_diagonal;
    if (shift > 1e6) {  // not even diagonally dominant by then: something in it is not a number
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j)
          if (i != j) a[std::size_t(n) * i + j] = 0;
    }
    shift = shift == 0 ? round_off : 4 * shift;
  }
  invert_factor(a, n);
  for (int i : cut) a[std::size_t(n) * i + i] = 0;
  return shift;
}

}  // namespace taut
