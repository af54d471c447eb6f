// What check_mesh refuses, mends and warns of.
#include <array>
#include <cmath>
#include <core/io/io_samples.hpp>
#include <cstdint>
#include <limits>
#include <taut/core/fem/mesh_check.hpp>

using namespace taut;
using namespace taut::test;

namespace {

std::string check_sentence(TetMesh mesh) {
  return sentence([&] { check_mesh(mesh, "'body'"); });
}

}  // namespace

TEST_CASE("a good mesh passes unchanged and is measured") {
  TetMesh mesh = two_tets();
  const MeshReport report = check_mesh(mesh, "'body'");
  CHECK(mesh.tets == two_tets().tets);
  CHECK(report.warnings.empty());
  CHECK(report.flipped == 0);
  CHECK(std::abs(report.volume - (1.0 / 3 + 0.7) / 6) < 1e-15);
}

TEST_CASE("the mean ratio is 1 for the regular tet and 0 in the limit of a flat one") {
  const TetMesh regular{{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, {}};
  CHECK(std::abs(mean_ratio(regular, {0, 1, 2, 3}) - 1) < 1e-14);
  // A right-angled corner of unit legs: V = 1/6, edges 3 x 1 and 3 x 2 squared.
  const TetMesh corner{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {}};
  CHECK(std::abs(mean_ratio(corner, {0, 1, 2, 3}) - 12 * std::cbrt(0.25) / 9) < 1e-14);
}

TEST_CASE("what cannot be simulated is refused by name") {
  TetMesh mesh = two_tets();
  check_says(check_sentence({mesh.points, {}}), {"'body'", "no tets"});
  mesh.tets[1][3] = 5;
  check_says(check_sentence(mesh), {"1 tet (1)", "5 vertices"});
  mesh.tets[1][3] = -1;
  check_says(check_sentence(mesh), {"1 tet (1)"});

  mesh = two_tets();
  mesh.points[4][1] = std::numeric_limits<double>::quiet_NaN();
  check_says(check_sentence(mesh), {"1 vertex (4)", "not finite"});

  mesh = two_tets();
  mesh.points[3] = {0.3, 0.3, 0};
  check_says(check_sentence(mesh), {"1 tet (0)", "zero volume"});
  // 1e-14 of the edge is beyond what coordinates resolve, 1e-8 of it is a sliver.
  mesh.points[3][2] = 1e-14;
  check_says(check_sentence(mesh), {"zero volume"});
  mesh.points[3][2] = 1e-8;
  const MeshReport report = check_mesh(mesh, "'body'");
  REQUIRE(report.warnings.size() == 1);
  check_says(report.warnings[0], {"1 tet (0)", "mean-ratio"});

  mesh = two_tets();
  mesh.tets.push_back({3, 0, 1, 2});
  std::swap(mesh.tets[2][0], mesh.tets[2][1]);  // keeps it positive
  check_says(check_sentence(mesh), {"1 tet (2)", "duplicates"});

  mesh = two_tets();
  mesh.points.push_back({5, 5, 5});
  check_says(check_sentence(mesh), {"1 vertex (5)", "no tet"});

  mesh = two_tets();
  for (int i = 0; i < 9; ++i) mesh.tets.push_back({0, 0, 1, 2});
  check_says(check_sentence(mesh), {"9 tets (2, 3, 4, 5, 6, 7, ...)", "zero volume"});
}

TEST_CASE("inverted tets are refused, flipped when asked, and flipped with a warning if all are") {
  TetMesh mixed = two_tets();
  std::swap(mixed.tets[1][0], mixed.tets[1][1]);
  check_says(check_sentence(mixed), {"1 tet (1) inverted", "of 2"});

  const MeshReport fixed = check_mesh(mixed, "'body'", Orientation::fix);
  CHECK(fixed.flipped == 1);
  REQUIRE(fixed.warnings.size() == 1);
  check_says(fixed.warnings[0], {"1 tet (1)", "flipped"});
  for (Tet const& tet : mixed.tets) CHECK(six_volume(mixed, tet) > 0);

  TetMesh negative = two_tets();
  for (Tet& tet : negative.tets) std::swap(tet[2], tet[3]);
  const MeshReport flipped = check_mesh(negative, "'body'");
  CHECK(flipped.flipped == 2);
  REQUIRE(flipped.warnings.size() == 1);
  check_says(flipped.warnings[0], {"all 2 tets", "flipped"});
  CHECK(negative.tets == two_tets().tets);
}

TEST_CASE("a face of three tets is a warning") {
  TetMesh mesh = two_tets();
  mesh.points.push_back({0.1, 0.1, 2});
  mesh.tets.push_back({0, 1, 2, 5});
  const MeshReport report = check_mesh(mesh, "'body'");
  REQUIRE(report.warnings.size() == 1);
  check_says(report.warnings[0], {"1 tet (2)", "two other tets"});
}
