// Multigrid as the preconditioner of minimisers.
#include <catch2/catch_test_macros.hpp>
#include <taut/core/potential/local_terms.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/potential/unknowns.hpp>
#include <taut/integrators/preconditioner.hpp>
#include <taut/mpm/grid_multigrid.hpp>

#include "elastic_grid.hpp"

namespace {

using namespace taut;
using namespace taut::test;

using Positions = VectorField<double, Right>;
using Inert = decltype(Potential(std::declval<Unknowns<Mixed, Right>&>(),
                                 Inertia(std::declval<Unknowns<Mixed, Right>&>())));
static_assert(Preconditioner<GridMultigrid<Mixed, Right>, Inert>);

/// What `update` asks of an objective: a quadratic function of the nodes of a box.
struct Quadratic {
  ElasticBox<Right, double> const& box;

  int size() const { return box.level.size(); }
  BlockCsr<Right> pattern(Positions const&) const {
    BlockPattern pattern{{0}, {}};
    for (int i = 0; i < size(); ++i) {
      for (int j : neighbours(i)) pattern.column.push_back(j);
      pattern.row_begin.push_back(static_cast<int>(pattern.column.size()));
    }
    return BlockCsr<Right>(pattern);
  }
  void assemble(Positions const&, BlockCsr<Right>& matrix) const {
    auto const& a = box.level.matrix();
    for (int i = 0; i < size(); ++i)
      for (int k = matrix.row_begin(i); k < matrix.row_begin(i + 1); ++k) {
        int d[3];
        for (int c = 0; c < 3; ++c) d[c] = a.nodes.ijk(matrix.column(k), c) - a.nodes.ijk(i, c);
        matrix.block(k) = a.block(i, d[0], d[1], d[2]);
      }
  }

private:
  std::set<int> neighbours(int i) const {
    auto const& nodes = box.level.nodes();
    std::set<int> found;
    for (Place const& d : test::box({-1, -1, -1}, {1, 1, 1})) {
      int const j =
          nodes.node(nodes.ijk(i, 0) + d[0], nodes.ijk(i, 1) + d[1], nodes.ijk(i, 2) + d[2]);
      if (j >= 0) found.insert(j);
    }
    return found;
  }
};

}  // namespace

TEST_CASE("multigrid of an assembled Hessian leaves fixed nodes alone", "[grid_multigrid]") {
  ElasticBox<Right, double> const problem(8, true, [](Place const&) { return 1e7; });
  Quadratic quadratic{problem};
  GridMultigrid<Mixed, Right> multigrid({.nodes = &problem.level.nodes()});
  Positions const x;
  multigrid.resize(quadratic.size());
  multigrid.update(quadratic, x);
  CHECK(multigrid.report().nodes.front() == 729);
  CHECK(multigrid.report().direct);
  // That of the same matrix, with the fixed nodes told.
  Multigrid<MatrixLevel<Right, double, 2>> cycle;
  cycle.build(problem.level);
  CHECK(multigrid.report().nodes == cycle.report().nodes);
  auto const g = random_field<Right, float>(729, 3);
  for (int i = 0; i < 729; ++i)
    for (int c = 0; c < 3; ++c) g(i, c) *= problem.level.fixed()(i) == 0 ? 1 : 0;
  VectorField<float, Right> z("z", 729), expected("z", 729);
  multigrid.apply(g, z);
  cycle.apply(g, expected);
  CHECK(difference(z, flat(expected, 729)) < 1e-4);
  for (int i = 0; i < 729; ++i) {
    if (problem.level.fixed()(i) != 0) CHECK((z(i, 0) == 0 && z(i, 1) == 0 && z(i, 2) == 0));
  }
  auto const apply = [&](Positions const& r, Positions const& to) {
    VectorField<float, Right> from("r", 729);
    for (int i = 0; i < 729; ++i)
      for (int c = 0; c < 3; ++c) from(i, c) = float(r(i, c));
    multigrid.apply(from, z);
    for (int i = 0; i < 729; ++i)
      for (int c = 0; c < 3; ++c) to(i, c) = z(i, c);
  };
  CHECK(pcg_iterations(problem.level, apply, 1e-5) <= 8);
}

TEST_CASE("multigrid says what is wrong with its grid", "[grid_multigrid]") {
  ElasticBox<Right, double> const problem(3, false, [](Place const&) { return 1e7; });
  Quadratic quadratic{problem};
  auto const error = [&](GridNodes<Right> const* nodes) -> std::string {
    GridMultigrid<Mixed, Right> multigrid({.nodes = nodes});
    try {
      multigrid.update(quadratic, Positions());
    } catch (Error const& e) {
      return e.what();
    }
    return "";
  };
  CHECK(error(nullptr).find("no grid") != std::string::npos);
  GridLevel<Right> other;
  other.assign(leaf_list({{0, 0, 0}}), 1);
  CHECK(error(&other.nodes()).find("64 unknowns are not the 1 nodes") != std::string::npos);
  CHECK(error(&problem.level.nodes()).empty());
}
