// A hierarchy whose fine level has no matrix.
#include "cycle_oracle.hpp"

namespace {

using namespace taut;
using namespace taut::test;

using Fine = MatrixLevel<Right, double, 2>;

/// A matrix that is told as an action.
struct Action {
  MatrixLevel<Right, double, 2> const* level;
  void product(VectorField<double, Right> const& x, VectorField<double, Right> const& y) const {
    level->product(x, y);
  }
  void diagonal(BlockField<double, Right> const& blocks) const {
    for (int i = 0; i < level->size(); ++i) {
      Sym3<double> const d = symmetric_part(level->matrix().block(i, 0, 0, 0));
      for (int k = 0; k < 6; ++k) blocks(i, k) = d.s[k];
    }
  }
  template <class Embedding, class T, int radius>
  void coarse_matrix(GridMatrix<Right, T, radius> const& coarse) const {
    level->coarse_matrix<Embedding>(coarse);
  }
};

}  // namespace

TEST_CASE("an operator without a matrix gets the cycle of its matrix", "[multigrid]") {
  auto const places = ragged(8, 5);
  Sample<Case<Right, double, 2>> const s(places, every_fifth(places.size()));
  Multigrid<Fine, Chebyshev, ForwardBackward, LinearEmbedding, double> assembled(
      {.direct_nodes = 10});
  assembled.build(s.level);
  Action const action{&s.level};
  ActionLevel<Action, Right, double> fine;
  fine.resize(s.grid.nodes(), s.level.fixed(), action);
  fine.finish();
  Multigrid<ActionLevel<Action, Right, double>, Chebyshev, ForwardBackward, LinearEmbedding, double>
      free({.direct_nodes = 10});
  free.build(fine);
  Dense const m = matrix_of(free, fine);
  CHECK((m - matrix_of(assembled, s.level)).norm() < 1e-13 * m.norm());
  check_metric(m, dense(s.level.matrix()), 1e-12);
}
