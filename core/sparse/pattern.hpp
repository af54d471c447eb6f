// Which blocks of a sparse matrix are stored: two unknowns that share an element couple.
#pragma once

#include <span>
#include <vector>

namespace taut {

/// Rows of sorted columns, as in compressed sparse rows.
struct BlockPattern {
  std::vector<int> row_begin;  ///< rows + 1
  std::vector<int> column;     ///< one per block
};

/// Elements of one kind: element e couples `vertices[per_element * e + k]`, k < per_element.
struct Connectivity {
  std::span<int const> vertices;
  int per_element = 4;
};

/// The pattern of a matrix over n unknowns that elements of several kinds are assembled into. It is
/// symmetric and holds every diagonal block, also of unknowns that no element touches. Throws Error
/// if an element names an unknown that does not exist.
BlockPattern pattern_from_elements(int n, std::span<Connectivity const> kinds);

}  // namespace taut
