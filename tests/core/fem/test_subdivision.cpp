// Edgewise subdivision: n^3 children of equal volume and their parent's orientation, few shapes,
// neighbours that agree, and the original mesh at n = 1.

#include <taut/core/fem/mesh_check.hpp>
#include <taut/core/fem/subdivision.hpp>

#include <algorithm>
#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <cmath>
#include <map>
#include <numeric>
#include <random>
#include <set>

using namespace taut;
using Catch::Matchers::WithinRel;

namespace {

/// Five tets that fill a cube, their vertices shuffled and the corners of each tet as well (in an
/// even permutation), so that neighbours see common faces in all ways.
TetMesh shuffled_cube(std::mt19937& engine) {
  TetMesh mesh;
  for (int v = 0; v < 8; ++v)
    mesh.points.push_back({double(v & 1), double(v >> 1 & 1), double(v >> 2)});
  mesh.tets = {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 2, 1, 7}, {5, 1, 4, 7}, {6, 4, 2, 7}};
  for (Tet& tet : mesh.tets)
    if (six_volume(mesh, tet) < 0) std::swap(tet[2], tet[3]);
  std::vector<std::int32_t> name(8);
  std::iota(name.begin(), name.end(), 0);
  std::shuffle(name.begin(), name.end(), engine);
  TetMesh renamed{std::vector<Point>(8), mesh.tets};
  for (std::size_t v = 0; v < 8; ++v)
    renamed.points[static_cast<std::size_t>(name[v])] = mesh.points[v];
  for (Tet& tet : renamed.tets) {
    for (std::int32_t& v : tet) v = name[static_cast<std::size_t>(v)];
    for (unsigned turns = engine() % 3; turns > 0; --turns)
      std::rotate(tet.begin(), tet.begin() + 1, tet.begin() + 3);
  }
  return renamed;
}

/// Squared lengths of the six edges, sorted: equal for congruent tets.
std::array<long long, 6> shape_of(TetMesh const& mesh, Tet const& tet) {
  std::array<long long, 6> lengths{};
  std::size_t e = 0;
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = a + 1; b < 4; ++b) {
      double sum = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        double const d = mesh.points[static_cast<std::size_t>(tet[a])][c] -
                         mesh.points[static_cast<std::size_t>(tet[b])][c];
        sum += d * d;
      }
      lengths[e++] = std::llround(1e9 * sum);
    }
  std::sort(lengths.begin(), lengths.end());
  return lengths;
}

}  // namespace

TEST_CASE("children have equal volumes, their parent's orientation and three shapes at most") {
  int const n = GENERATE(1, 2, 3, 5);
  TetMesh const parent{{{0, 0, 0}, {1.3, 0.1, 0}, {0.2, 0.9, 0.3}, {0.1, 0.4, 1.1}},
                       {{2, 1, 3, 0}}};
  TetMesh const fine = split_edges(parent, n);
  double const share = six_volume(parent, parent.tets[0]) / (n * n * n);
  REQUIRE(share != 0);
  CHECK(fine.tets.size() == static_cast<std::size_t>(n * n * n));
  CHECK(fine.points.size() == static_cast<std::size_t>((n + 1) * (n + 2) * (n + 3) / 6));
  std::set<std::array<long long, 6>> shapes;
  for (Tet const& tet : fine.tets) {
    CHECK_THAT(six_volume(fine, tet), WithinRel(share, 1e-12));
    shapes.insert(shape_of(fine, tet));
  }
  CHECK(shapes.size() <= 3);
}

TEST_CASE("neighbours agree however their vertices are numbered") {
  std::mt19937 engine(7);
  for (int trial = 0; trial < 20; ++trial) {
    TetMesh const coarse = shuffled_cube(engine);
    int const n = 1 + trial % 4;
    TetMesh fine = split_edges(coarse, n);
    MeshReport const report = check_mesh(fine, "cube");  // conforming, positive, no vertex idle
    CHECK(report.warnings.empty());
    CHECK(report.flipped == 0);
    CHECK_THAT(report.volume, WithinRel(1.0, 1e-12));
    // Every face inside is shared; those of the surface are the twelve of the cube, cut n^2 times.
    CHECK(boundary_faces(fine.tets).size() == static_cast<std::size_t>(12 * n * n));
    std::set<Point> const places(fine.points.begin(), fine.points.end());
    CHECK(places.size() == fine.points.size());
  }
}

TEST_CASE("the vertices keep their numbers, and one piece is the mesh itself") {
  std::mt19937 engine(8);
  TetMesh const coarse = shuffled_cube(engine), fine = split_edges(coarse, 3);
  CHECK(std::equal(coarse.points.begin(), coarse.points.end(), fine.points.begin()));
  TetMesh const same = split_edges(coarse, 1);
  CHECK(same.points == coarse.points);
  REQUIRE(same.tets.size() == coarse.tets.size());
  for (std::size_t t = 0; t < same.tets.size(); ++t) {
    CHECK(std::is_permutation(same.tets[t].begin(), same.tets[t].end(), coarse.tets[t].begin()));
    CHECK(six_volume(same, same.tets[t]) == six_volume(coarse, coarse.tets[t]));
  }
}
