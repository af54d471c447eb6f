// The hierarchy of HOT on the Hessian of its energy, against numbers from an independent
// implementation of the same formulas: one particle per eighth of a cell, fixed corotated,
// stretched.
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <taut/materials/elastic.hpp>
#include <taut/materials/fixed_corotated.hpp>

#include "elastic_grid.hpp"
#include "support/data.hpp"

namespace {

using namespace taut;
using namespace taut::test;
using Catch::Matchers::WithinRel;
using Fine = MatrixLevel<Right, double, 2>;
using Hot = Multigrid<Fine, SymmetricGaussSeidel, SymmetricGaussSeidel, LinearEmbedding, double>;

double fraction(double x) { return x - std::floor(x); }

/// m + dt^2 K of the stretched block, projected.
void assemble_stretched_block(GridMatrix<Right, double, 2> const& a) {
  using Material = Elastic<FixedCorotated, FullProjection>;
  double const dx = 0.1, step = 1.0 / 24, volume = dx * dx * dx / 8, density = 1000;
  auto const lame = lame_parameters(1e5, 0.3);
  set_zero(a);
  for (int p = 0; p < 512; ++p) {
    int const lattice[3] = {p / 64, p / 8 % 8, p % 8};
    double x[3];
    for (int c = 0; c < 3; ++c) x[c] = 8.25 + 0.5 * lattice[c];
    double const golden[3] = {0.6180339887498949, 0.4142135623730951, 0.7320508075688772};
    Mat3<double> F{};
    for (int c = 0; c < 3; ++c) F(c, c) = 0.7 + 0.6 * fraction((p + 1) * golden[c]);
    auto const frame = Material::frame(Material::evaluate(lame, F));
    Support const support(x);
    for (auto const& [place, value] : support.nodes) {
      int const i = a.nodes.node(place[0], place[1], place[2]);
      REQUIRE(i >= 0);
      Vec3<double> const b =
          transpose_times(frame.V, transpose_times(F, (1 / dx) * value.gradient));
      Mat3<double> own = a.block(i, 0, 0, 0);
      for (int c = 0; c < 3; ++c) own(c, c) += density * volume * value.weight;
      a.set(i, 0, 0, 0, own);
      for (auto const& [other, from] : support.nodes) {
        int const d[3] = {other[0] - place[0], other[1] - place[1], other[2] - place[2]};
        Vec3<double> const e =
            transpose_times(frame.V, transpose_times(F, (1 / dx) * from.gradient));
        a.set(i, d[0], d[1], d[2],
              a.block(i, d[0], d[1], d[2]) + step * step * volume * frame.vertex_pair(b, e));
      }
    }
  }
}

}  // namespace

TEST_CASE("the hierarchy and the cycles of the reference", "[multigrid_reference]") {
  auto const golden = hot_vectors("one_step_goldens").at("stretch");
  GridLevel<Right> grid;
  grid.assign(leaf_list(box({7, 7, 7}, {13, 13, 13})), 0.1);
  Fine fine;
  fine.resize(grid.nodes());
  assemble_stretched_block(fine.matrix());
  fine.finish();
  int const n = fine.size();
  auto const number = [&](auto const& from, std::string const& key) {
    return from.at(key).template get<double>();
  };
  Dense const h = dense(fine.matrix());
  CHECK_THAT(h.norm(), WithinRel(number(golden, "H_frob"), 1e-10));

  // q runs over the nodes in the order of their places, which is not that of their numbers.
  std::vector<int> order;
  for (Place const& p : box({7, 7, 7}, {13, 13, 13})) {
    order.push_back(grid.nodes().node(p[0], p[1], p[2]));
  }
  VectorField<double, Right> q("q", n), u("u", n);
  for (int k = 0; k < 3 * n; ++k) q(order[k / 3], k % 3) = std::sin(0.7 * k + 0.3);
  fine.product(q, u);
  CHECK_THAT(flat(u, n).norm(), WithinRel(number(golden, "Hq_l2"), 1e-10));

  LevelVectors<double, Right> v;
  v.resize(n);
  assign(Kokkos::subview(v.b, Kokkos::make_pair(0, n), Kokkos::ALL), q);
  SymmetricGaussSeidel().first(fine, v);
  CHECK_THAT(flat(v.x, n).norm(), WithinRel(number(golden, "sgs_q_l2"), 1e-7));

  auto const check = [&](Hot cycle, std::string const& key) {
    CAPTURE(key);
    cycle.build(fine);
    REQUIRE(cycle.report().direct);
    auto const frobenius = golden.at("coarse_frob");
    for (std::size_t l = 1; l < cycle.report().nodes.size(); ++l) {
      int const count = golden.at("levels")[l];
      double const expected = frobenius[l];
      CHECK(cycle.report().nodes[l] == count);
      CHECK_THAT(dense(cycle.level(static_cast<int>(l) - 1).matrix()).norm(),
                 WithinRel(expected, 1e-10));
    }
    cycle.apply(q, u);
    // The lightest node has 6e-8 of the mass of a full one; its 1e6 of them carry the round-off.
    CHECK_THAT(flat(u, n).norm(), WithinRel(number(golden.at(key), "l2"), 1e-6));
    CHECK_THAT(flat(u, n).dot(flat(q, n)), WithinRel(number(golden.at(key), "qTu"), 1e-6));
    for (int k = 0; k < 9; ++k) {
      double const expected = golden.at(key).at("first9")[k];
      CHECK(std::abs(u(order[k / 3], k % 3) - expected) < 1e-6 * flat(u, n).norm());
    }
  };
  check(Hot({.max_levels = 2, .direct_nodes = 125}), "vcycle2_exact_coarse");
  check(Hot({.max_levels = 3, .direct_nodes = 64}), "vcycle3_exact_coarse");
}
