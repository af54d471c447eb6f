// Restriction, prolongation and the Galerkin product against dense matrices.
#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include "grid_samples.hpp"
#include "support/data.hpp"

namespace {

using namespace taut;
using namespace taut::test;

template <class Embedding_, class S, class T, int radius>
struct EmbeddedCase : Case<S, T, radius> {
  using Embedding = Embedding_;
};

}  // namespace

TEMPLATE_TEST_CASE("the coarse matrix is P'AP", "[galerkin]",
                   (EmbeddedCase<LinearEmbedding, Right, double, 2>),
                   (EmbeddedCase<LinearEmbedding, Left, float, 3>),
                   (EmbeddedCase<QuadraticEmbedding, Right, double, 2>)) {
  using Embedding = typename TestType::Embedding;
  using S = typename TestType::S;
  using T = typename TestType::Real;
  constexpr int radius = Embedding::radius == 1 ? 2 : 3;
  auto const check = [&](std::set<Place> const& places, bool with_fixed) {
    std::vector<std::uint8_t> fixed;
    if (with_fixed) {
      for (std::size_t i = 0; i < places.size(); ++i) fixed.push_back(i % 5 == 0);
    }
    Sample<TestType> const s(places, fixed);
    Dense fine = s.matrix;
    GridLevel<S> grid;
    std::set<Place> free;
    for (int i = 0; i < s.size(); ++i) {
      if (fixed.empty() || fixed[i] == 0) free.insert(place(s.grid.nodes(), i));
    }
    grid.coarsen(leaf_list(free), Embedding::radius, 0.1);
    Dense const p = prolongation<Embedding>(s.grid.nodes(), grid.nodes(), fixed);
    Dense const expected = p.transpose() * fine * p;
    CHECK(expected.diagonal().minCoeff() > 0);

    GridMatrix<S, T, radius> coarse;
    coarse.resize(grid.nodes());
    assign(coarse.entry, T(7));  // what it was is no matter
    s.level.template coarse_matrix<Embedding>(coarse);
    double const close = (std::is_same_v<T, float> ? 1e-6 : 3e-15);
    CHECK((dense(coarse) - expected).norm() <= close * expected.norm());
    for (int i = 0; i < coarse.size(); ++i)
      for (int run = 0; run < StencilRow<radius>::runs * 3; ++run)
        for (int k = 3 * StencilRow<radius>::width; k < StencilRow<radius>::padded; ++k)
          REQUIRE(coarse.entry(i, run * StencilRow<radius>::padded + k) == 0);

    // As a device makes it.
    GridMatrix<S, T, radius> blockwise;
    blockwise.resize(grid.nodes());
    for_each<S>("blocks", coarse.size() * StencilRow<radius>::runs,
                kernels::GalerkinBlocks<S, Embedding, T, TestType::radius, T, radius>{
                    s.level.matrix(), blockwise, s.level.fixed()});
    CHECK((dense(blockwise) - expected).norm() <= close * expected.norm());

    // Vectors, too.
    auto const x = random_field<S, T>(s.size(), 1), y = random_field<S, T>(s.size(), 2);
    VectorField<T, S> c("coarse", grid.nodes().count);
    restrict_to<Embedding>(s.grid.nodes(), s.level.fixed(), x, grid.nodes(), c);
    CHECK((flat(c, grid.nodes().count) - p.transpose() * flat(x, s.size())).norm() < 10 * close);
    Eigen::VectorXd const sum = flat(y, s.size()) + p * flat(c, grid.nodes().count);
    add_prolonged<Embedding>(grid.nodes(), c, s.grid.nodes(), s.level.fixed(), y);
    CHECK((flat(y, s.size()) - sum).norm() <= 10 * close * sum.norm());
  };
  check(ragged(3, 7), false);
  check(ragged(4, 7), true);
  check({{-1, -1, -1}}, false);
}

TEST_CASE("prolongation and the coarse matrix are those of the reference's formulas",
          "[galerkin]") {
  auto const prolongations = hot_vectors("prolongation");
  auto const check = [&](auto embedding, std::string const& key, int low) {
    using Embedding = decltype(embedding);
    CAPTURE(key);
    auto const& v = prolongations.at(key);
    GridLevel<Right> fine, coarse;
    fine.assign(leaf_list(box({low, low, low}, {low + 5, low + 5, low + 5})), 1);
    coarse.coarsen(fine.leaves(), Embedding::radius, 1);
    int const fine_count = v.at("fine"), coarse_count = v.at("coarse"), entries = v.at("nnz"),
              longest = v.at("max_nnz_col");
    CHECK(fine.nodes().count == fine_count);
    CHECK(coarse.nodes().count == coarse_count);
    Dense const p = prolongation<Embedding>(fine.nodes(), coarse.nodes());
    CHECK((p.array() != 0).count() == 3 * entries);
    CHECK((p.array() != 0).colwise().count().maxCoeff() == longest);
    CHECK((p.rowwise().sum() - Eigen::VectorXd::Ones(p.rows())).cwiseAbs().maxCoeff() == 0);
    if (!v.at("col_sum_by_coarse").is_object()) return;
    for (auto const& [name, sum] : v.at("col_sum_by_coarse").items()) {
      Place c{};
      REQUIRE(std::sscanf(name.c_str(), "%d,%d,%d", &c[0], &c[1], &c[2]) == 3);
      int const i = coarse.nodes().node(c[0], c[1], c[2]);
      REQUIRE(i >= 0);
      double const expected = sum;
      CHECK(p.col(3 * i).sum() == expected);
    }
  };
  check(LinearEmbedding(), "3d_lo4_linear", 4);
  check(LinearEmbedding(), "3d_lo5_linear", 5);
  check(QuadraticEmbedding(), "3d_lo4_quadratic", 4);
  check(QuadraticEmbedding(), "3d_lo5_quadratic", 5);
}

TEST_CASE("the coarse stiffness of particles is the reference's", "[galerkin]") {
  auto const v = hot_vectors("galerkin_6cubed_scalar");
  GridLevel<Right> fine, coarse;
  fine.assign(leaf_list(box({4, 4, 4}, {9, 9, 9})), 1);
  coarse.coarsen(fine.leaves(), 1, 1);
  Dense k = Dense::Zero(3 * 216, 3 * 216);
  for (int p = 0; p < 512; ++p) {
    double const x[3] = {4.75 + 0.5 * (p / 64), 4.75 + 0.5 * (p / 8 % 8), 4.75 + 0.5 * (p % 8)};
    Support const s(x);
    for (auto const& [a, ga] : s.nodes)
      for (auto const& [b, gb] : s.nodes) {
        int const i = fine.nodes().node(a[0], a[1], a[2]), j = fine.nodes().node(b[0], b[1], b[2]);
        double const value = 0.125 * dot(ga.gradient, gb.gradient);
        for (int c = 0; c < 3; ++c) k(3 * i + c, 3 * j + c) += value;
      }
  }
  MatrixLevel<Right, double, 2> level;
  level.resize(fine.nodes());
  fill(level.matrix(), k);
  GridMatrix<Right, double, 2> below;
  below.resize(coarse.nodes());
  level.coarse_matrix<LinearEmbedding>(below);
  Dense const found = dense(below);
  auto const& kc = v.at("Kc");  // by places in lexicographic order
  double worst = 0;
  for (int i = 0; i < 64; ++i)
    for (int j = 0; j < 64; ++j) {
      int const a = coarse.nodes().node(2 + i / 16, 2 + i / 4 % 4, 2 + i % 4);
      int const b = coarse.nodes().node(2 + j / 16, 2 + j / 4 % 4, 2 + j % 4);
      worst = std::max(worst, std::abs(found(3 * a, 3 * b) - kc[i][j].get<double>()));
      CHECK(found(3 * a, 3 * b + 1) == 0);
    }
  CHECK(worst < 1e-14);
}
