#include <taut/core/exec/buckets.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/sparse/pattern.hpp>

#include <algorithm>
#include <limits>

namespace taut {
namespace {

void check(Connectivity const& kind, int n) {
  if (kind.per_element < 1 || kind.vertices.size() % kind.per_element != 0) {
    throw Error(
        "sparse pattern: {} vertex indices are not whole elements of {} vertices; pass all "
        "vertices "
        "of every element",
        kind.vertices.size(), kind.per_element);
  }
  for (std::size_t k = 0; k < kind.vertices.size(); ++k) {
    int const v = kind.vertices[k];
    if (v < 0 || v >= n) {
      throw Error(
          "sparse pattern: element {} names unknown {}, but there are {} (0 to {}); check the "
          "element's vertex indices",
          k / kind.per_element, v, n, n - 1);
    }
  }
}

}  // namespace

BlockPattern pattern_from_elements(int n, std::span<Connectivity const> kinds) {
  std::vector<Buckets> incidence;  // per kind, the places in `vertices` that name each unknown
  for (Connectivity const& kind : kinds) {
    check(kind, n);
    incidence.push_back(sort_into_buckets(kind.vertices, n));
  }

  BlockPattern pattern;
  pattern.row_begin.assign(1, 0);
  pattern.row_begin.reserve(n + 1);
  std::vector<int> seen_in(n, -1);  // the last row that stored this column
  std::vector<int> row;
  for (int i = 0; i < n; ++i) {
    row.assign(1, i);
    seen_in[i] = i;
    for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
      int const size = kinds[kind].per_element;
      Buckets const& touching = incidence[kind];
      for (int k = touching.begin[i]; k < touching.begin[i + 1]; ++k) {
        int const first = touching.item[k] / size * size;
        for (int const j : kinds[kind].vertices.subspan(first, size)) {
          if (seen_in[j] == i) continue;
          seen_in[j] = i;
          row.push_back(j);
        }
      }
    }
    std::sort(row.begin(), row.end());
    pattern.column.insert(pattern.column.end(), row.begin(), row.end());
    if (pattern.column.size() > std::size_t(std::numeric_limits<int>::max())) {
      throw Error(
          "sparse pattern: the matrix has more than {} blocks by row {} of {}; use a matrix-free "
          "Hessian",
          std::numeric_limits<int>::max(), i, n);
    }
    pattern.row_begin.push_back(static_cast<int>(pattern.column.size()));
  }
  return pattern;
}

}  // namespace taut
