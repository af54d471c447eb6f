// Barriers and pairs against the shared vectors.
#include "../support/data.hpp"
#include "pair_samples.hpp"

#include <taut/contact/pair.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>

#include <map>

using namespace taut;
using namespace taut::test;
using namespace taut::test::pairs;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

using Paper = PairEnergy<LogBarrier, TruncatedCurvature, NoMollifier>;
using Exact = PairEnergy<LogBarrier, ExactCurvature, NoMollifier>;

Feature feature_of(std::string const& kind, std::string const& region, nlohmann::json const& c) {
  static std::map<std::string, Feature> const triangle{
      {"face", Feature::face},   {"E01", Feature::edge_01}, {"E12", Feature::edge_12},
      {"E02", Feature::edge_20}, {"V0", Feature::vertex_0}, {"V1", Feature::vertex_1},
      {"V2", Feature::vertex_2}};
  if (kind == "PT") return triangle.at(region);
  int const a = double(c[0]) == 0 ? 1 : 0, b = double(c[2]) == 0 ? 1 : 0;  // where an end
  if (region == "EE") return Feature::edge_edge;
  if (region == "P(A)E(B)") return a == 0 ? Feature::a0_b : Feature::a1_b;
  if (region == "E(A)P(B)") return b == 0 ? Feature::a_b0 : Feature::a_b1;
  REQUIRE(region == "PP");
  return static_cast<Feature>(static_cast<int>(Feature::a0_b0) + 2 * a + b);
}

// The least eigenvalue of the second derivative as it is.
double least_eigenvalue(PairState<double> const& s) {
  SquareMatrix<double, 12> h;
  for (int a = 0; a < 4; ++a)
    for (int b = 0; b < 4; ++b) {
      Mat3<double> const block = ExactCurvature::block(s, a, b);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) h(3 * a + i, 3 * b + j) = block(i, j);
    }
  auto const eigen = symmetric_eigen(h);
  double least = eigen.values[0];
  for (double v : eigen.values) least = std::min(least, v);
  return least;
}

}  // namespace

TEST_CASE("the logarithmic barrier reproduces the shared vectors", "[contact]") {
  for (auto const& c : test::vectors("barrier_scalar")) {
    double const kappa = c["kappa"], d = c["d"], dhat = c["dhat"];
    INFO("d = " << d << ", dhat = " << dhat);
    auto const b = evaluate_barrier<LogBarrier>(d, dhat);
    // The vectors' own formula cancels next to dhat.
    double const tolerance = 1e-13 + 1e-15 / square(1 - d / dhat);
    CHECK_THAT(kappa * b.value, WithinRel(double(c["b"]), tolerance));
    CHECK_THAT(kappa * b.slope, WithinRel(double(c["db"]), tolerance));
    CHECK_THAT(kappa * b.curvature, WithinRel(double(c["d2b"]), tolerance));
  }
}

TEST_CASE("pairs reproduce the shared vectors", "[contact]") {
  int compared = 0;
  for (auto const& c : test::vectors("contact")) {
    INFO(c["name"]);
    std::string const kind = c["kind"];
    PairKind const pair_kind = kind == "PT" ? PairKind::point_triangle : PairKind::edge_edge;
    Vec3<double> y[4], p[4];
    for (int a = 0; a < 4; ++a)
      for (int k = 0; k < 3; ++k) {
        y[a][k] = c["y"][a][k];
        p[a][k] = c["p"][3 * a + k];
      }
    auto const s =
        Paper::evaluate(pair_kind, PairParameters<double>{c["kappa"], c["dhat"], 0.0}, y);
    double const d = c["d"];
    CHECK_THAT(s.at.distance, WithinRel(d, 1e-11));
    CHECK_THAT(Paper::value(s), WithinRel(double(c["b"]), 1e-11));
    CHECK_THAT(s.b1, WithinRel(double(c["db"]), 1e-11));
    CHECK_THAT(s.b2, WithinRel(double(c["d2b"]), 1e-11));
    if (c["name"] == "EE_parallel_exact") continue;  // closest everywhere along the overlap
    ++compared;
    // The vectors know where nearly parallel edges cross to epsilon over their angle squared.
    double const tolerance = c["name"] == "EE_near_parallel_1e-4rad" ? 1e-7 : 1e-11;
    CHECK(s.at.feature == feature_of(kind, c["region"], c["c"]));
    double const force = c["grad_norm"];
    double diagonal_size = 0, moved = 0;
    for (double h : c["diag"]) diagonal_size = std::max(diagonal_size, std::abs(h));
    for (auto const& v : p) moved += dot(v, v);
    for (int k = 0; k < 3; ++k) CHECK_THAT(s.at.t[k], WithinAbs(double(c["t"][k]), tolerance * d));
    for (int a = 0; a < 4; ++a) {
      CHECK_THAT(s.at.c[a], WithinAbs(double(c["c"][a]), tolerance));
      Vec3<double> const g = Paper::gradient(s, a), h = Paper::diagonal(s, a);
      Mat3<double> const raw = TruncatedCurvature::block(s, a, a);
      for (int k = 0; k < 3; ++k) {
        std::size_t const i = std::size_t(3 * a + k);
        CHECK_THAT(g[k], WithinAbs(double(c["grad"][i]), tolerance * force));
        CHECK_THAT(raw(k, k), WithinAbs(double(c["diag"][i]), tolerance * diagonal_size));
        CHECK_THAT(h[k], WithinAbs(double(c["diag_clamped"][i]), tolerance * diagonal_size));
      }
    }
    double const form_size = diagonal_size * moved;
    CHECK_THAT(TruncatedCurvature::form(s, p), WithinAbs(double(c["pHp"]), tolerance * form_size));
    CHECK_THAT(Paper::quadratic(s, p), WithinAbs(double(c["pHp_clamped"]), tolerance * form_size));
    // Ours is the right feature where the reference's is not: it only ever overestimates.
    CHECK(double(c["reference_classification"]["d"]) >= s.at.distance * (1 - 1e-12));

    auto const& exact = c["exact_fd"];
    if (!exact["valid"]) continue;  // a kink
    double const size = exact["diag_max_true"], curvature = std::max(size, diagonal_size);
    double const form = ExactCurvature::form(s, p);
    CHECK_THAT(form, WithinAbs(double(exact["pHp"]), 1e-8 * curvature * moved));
    CHECK_THAT(Exact::quadratic(s, p), WithinAbs(std::max(form, 0.0), 1e-12 * form_size));
    for (int a = 0; a < 4; ++a) {
      Mat3<double> const block = ExactCurvature::block(s, a, a);
      for (int k = 0; k < 3; ++k) {
        CHECK_THAT(block(k, k), WithinAbs(double(exact["diag"][3 * a + k]), 1e-8 * curvature));
      }
    }
    CHECK_THAT(least_eigenvalue(s), WithinAbs(double(exact["min_eig"]), 1e-7 * curvature));
  }
  CHECK(compared == 13);
}

TEST_CASE("the truncated curvature falls short of the exact one as the shared statistics say",
          "[contact]") {
  auto const statistics = test::vectors("contact_statistics");
  std::map<std::string, Feature> const regions{
      {"PT:face", Feature::face},    {"PT:E12", Feature::edge_12},   {"PT:V0", Feature::vertex_0},
      {"EE:EE", Feature::edge_edge}, {"EE:P(A)E(B)", Feature::a0_b}, {"EE:PP", Feature::a0_b0}};
  REQUIRE(statistics.size() == regions.size());
  Random random(6);
  for (auto const& [region, expected] : statistics.items()) {
    INFO(region);
    Feature const feature = regions.at(region);
    bool const slides = feature != Feature::vertex_0 && feature != Feature::a0_b0;
    int const count = 2000;
    int paper_le_exact = 0, paper_negative = 0, exact_negative = 0;
    double worst = 0;
    for (int k = 0; k < count; ++k) {
      double const dhat = 0.1;
      Corners const corners = corners_of(random, feature, dhat * uniform(random, 0.1, 0.9), 1);
      Vec3<double> y[4], p[4];
      for (std::size_t a = 0; a < 4; ++a) {
        y[a] = corners[a];
        p[a] = uniform_vector(random);
      }
      auto const s = Paper::evaluate(kind_of(feature), PairParameters<double>{4.0, dhat, 0.0}, y);
      REQUIRE(s.at.feature == feature);
      double const paper = TruncatedCurvature::form(s, p), exact = ExactCurvature::form(s, p);
      double const size = s.b2 - s.b1 / s.at.distance;
      paper_le_exact += paper <= exact + 1e-13 * size;
      paper_negative += paper < 0;
      exact_negative += exact < 0;
      worst = std::max(worst, std::abs(paper - exact) / size);
    }
    double const n = expected["n"];
    if (slides) {
      CHECK(paper_le_exact == count);
      CHECK(double(expected["paper_le_exact"]) == n);
      CHECK(paper_negative > exact_negative);
      CHECK(expected["paper_negative"] > expected["exact_negative"]);
    } else {
      CHECK(worst < 1e-13);  // nothing slides
      CHECK(paper_negative == exact_negative);
      CHECK(expected["paper_negative"] == expected["exact_negative"]);
    }
  }
}
