#include <taut/core/report/error.hpp>
#include <taut/core/sparse/pattern.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <numeric>

namespace taut {
namespace {

/// The elements of one kind that touch each unknown, in compressed rows.
struct Incidence {
  std::vector<int> begin, element;

  Incidence(int n, Connectivity const& kind) : begin(n + 1, 0), element(kind.vertices.size()) {
    int const count = static_cast<int>(kind.vertices.size());
    for (int k = 0; k < count; ++k) {
      int const v = kind.vertices[k];
      if (v < 0 || v >= n) {
        throw Error(
            "sparse pattern: element {} names unknown {}, but there are {} (0 to {}); check the "
            "element's vertex indices",
            k / kind.per_element, v, n, n - 1);
      }
      ++begin[v + 1];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<int> next(begin.begin(), begin.end() - 1);
    for (int k = 0; k < count; ++k) element[next[kind.vertices[k]]++] = k / kind.per_element;
  }
};

void check_shape(Connectivity const& kind) {
  if (kind.per_element < 1 || kind.vertices.size() % kind.per_element != 0) {
    throw Error(
        "sparse pattern: {} vertex indices are not whole elements of {} vertices; pass all "
        "vertices "
        "of every element",
        kind.vertices.size(), kind.per_element);
  }
}

}  // namespace

BlockPattern pattern_from_elements(int n, std::span<Connectivity const> kinds) {
  std::vector<Incidence> incidence;
  for (Connectivity const& kind : kinds) {
    check_shape(kind);
    incidence.emplace_back(n, kind);
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
      Incidence const& touching = incidence[kind];
      for (int e = touching.begin[i]; e < touching.begin[i + 1]; ++e) {
        for (int const j :
             kinds[kind].vertices.subspan(std::size_t(touching.element[e]) * size, size)) {
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
