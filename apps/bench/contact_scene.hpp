// The scene that the bench of contact works on: two thin sheets of tets, wavy, crossed by a fifth
// of a right angle, one a little above the other. The gap between them varies between a fifth and
// seven fifths of dhat, so that some pairs act, some nearly do, and all are of every kind. Their
// shape is their rest shape.
#pragma once

#include <taut/apps/program/elastic_terms.hpp>
#include <taut/contact/surface.hpp>

#include <vector>

namespace taut {

struct ContactScene {
  int cells;     ///< along a side of a sheet of 1 m, one across
  double dhat;   ///< 0.3 of the mean edge of the surface, m
  TetMesh rest;  ///< in the solver's order
  std::vector<int> object;
  Surface surface;
  std::vector<double> mass;
  std::vector<Point> direction;  ///< m: one sheet against the other by a fiftieth of dhat, uneven

  /// For about `contacts` of them.
  explicit ContactScene(int contacts);
};

}  // namespace taut
