// Surfaces of tet meshes and of triangles, whole and broken ones.
#include <support/data.hpp>
#include <taut/contact/surface.hpp>
#include <taut/core/fem/shapes.hpp>
#include <taut/core/io/mesh_reader.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_floating_point.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>
#include <set>

using namespace taut;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinRel;

namespace {

Surface surface_of(TetMesh const& mesh) {
  return make_surface(boundary_faces(mesh.tets), std::vector<int>(mesh.points.size(), 0));
}

/// Volume inside the triangles, by the divergence theorem.
double enclosed_volume(Surface const& surface, std::vector<Point> const& x) {
  double volume = 0;
  for (Triangle const& t : surface.triangles) {
    Point const &a = x[t[0]], &b = x[t[1]], &c = x[t[2]];
    volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0])) /
              6;
  }
  return volume;
}

/// An octahedron: closed, six vertices.
std::vector<Triangle> octahedron() {
  return {{0, 1, 2}, {0, 2, 3}, {0, 3, 4}, {0, 4, 1}, {5, 2, 1}, {5, 3, 2}, {5, 4, 3}, {5, 1, 4}};
}

}  // namespace

TEST_CASE("the surface of a tet mesh is closed, outward, and complete", "[contact]") {
  for (Shape const& shape : {Shape(BoxShape{{1, 2, 0.5}}), Shape(SphereShape{0.7}),
                             Shape(TorusShape{0.5, 0.2}), Shape(LetterEShape{})}) {
    TetMesh const mesh = make_shape(shape, 9);
    Surface const surface = surface_of(mesh);
    INFO("shape " << shape.index());

    SurfaceReport const report = check_surface(surface, "shape");
    CHECK(report.warnings.empty());
    CHECK(report.open.empty());
    CHECK(report.crowded.empty());
    CHECK(report.twisted.empty());
    CHECK(report.repeated.empty());

    // Euler's formula: V - E + F is 2 for a sphere, 0 for a torus.
    auto const euler =
        std::ssize(surface.vertices) - std::ssize(surface.edges) + std::ssize(surface.triangles);
    CHECK(euler == (std::holds_alternative<TorusShape>(shape) ? 0 : 2));
    CHECK(2 * surface.edges.size() == 3 * surface.triangles.size());

    double volume = 0;
    for (Tet const& t : mesh.tets) {
      Triangle const base{t[1], t[2], t[3]};
      Point const &a = mesh.points[t[0]], &b = mesh.points[base[0]], &c = mesh.points[base[1]],
                  &d = mesh.points[base[2]];
      Point const u{b[0] - a[0], b[1] - a[1], b[2] - a[2]},
          v{c[0] - a[0], c[1] - a[1], c[2] - a[2]}, w{d[0] - a[0], d[1] - a[1], d[2] - a[2]};
      volume += (u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
                 u[2] * (v[0] * w[1] - v[1] * w[0])) /
                6;
    }
    CHECK_THAT(enclosed_volume(surface, mesh.points), WithinRel(volume, 1e-10));

    CHECK(std::is_sorted(surface.edges.begin(), surface.edges.end()));
    std::set<std::int32_t> corners;
    for (Edge const& e : surface.edges) {
      CHECK(e[0] < e[1]);
      corners.insert(e.begin(), e.end());
    }
    CHECK(std::equal(corners.begin(), corners.end(), surface.vertices.begin(),
                     surface.vertices.end()));
  }
}

TEST_CASE("surfaces of the reference meshes have the published sizes", "[contact]") {
  struct Known {
    char const* name;
    std::size_t faces, edges, vertices;
    double mean;
  };
  for (Known const& known :
       {Known{"e_2", 1620, 2430, 812, 0.1050}, Known{"rod300x33", 19966, 29949, 9985, 0.00408}}) {
    std::string const name = known.name;
    TetMesh const mesh =
        read_tet_mesh(test::data_file("meshes/pncg/" + name + "/" + name + ".node"));
    Surface const surface = surface_of(mesh);
    INFO(name);
    CHECK(surface.triangles.size() == known.faces);
    CHECK(surface.edges.size() == known.edges);
    CHECK(surface.vertices.size() == known.vertices);
    CHECK(check_surface(surface, name).warnings.empty());
    EdgeLengths const lengths = edge_lengths(surface, mesh.points);
    CHECK_THAT(lengths.mean, WithinRel(known.mean, 2e-3));
    CHECK(lengths.min < lengths.mean);
    CHECK(lengths.max > lengths.mean);
  }
}

TEST_CASE("lengths of edges", "[contact]") {
  Surface const surface = make_surface({{0, 1, 2}}, {0, 0, 0});
  std::vector<Point> const points{{0, 0, 0}, {3, 0, 0}, {3, 4, 0}};
  EdgeLengths const lengths = edge_lengths(surface, points);
  CHECK(lengths.mean == 4);
  CHECK(lengths.min == 3);
  CHECK(lengths.max == 5);
  CHECK(edge_lengths(make_surface({}, {}), {}).max == 0);
}

TEST_CASE("a triangle mesh enters beside a tet mesh", "[contact]") {
  TetMesh const cube = make_shape(BoxShape{}, 1);
  auto const n = static_cast<std::int32_t>(cube.points.size());
  std::vector<Triangle> triangles = boundary_faces(cube.tets);
  std::vector<int> object(n, 0);
  for (Triangle const& t : octahedron()) triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  object.insert(object.end(), 6, 1);
  Surface const surface = make_surface(triangles, object);
  CHECK(check_surface(surface, "both").warnings.empty());
  CHECK(surface.triangles.size() == boundary_faces(cube.tets).size() + 8);
  CHECK(std::find(surface.edges.begin(), surface.edges.end(), Edge{n, n + 1}) !=
        surface.edges.end());
}

TEST_CASE("what is wrong with a surface is named", "[contact]") {
  std::vector<int> const object(9, 0);

  SECTION("open") {
    auto triangles = octahedron();
    triangles.erase(triangles.begin());  // 0-1-2
    SurfaceReport const report = check_surface(make_surface(triangles, object), "bowl");
    CHECK(report.open == std::vector<Edge>{{0, 1}, {0, 2}, {1, 2}});
    REQUIRE(report.warnings.size() == 1);
    CHECK_THAT(report.warnings[0], ContainsSubstring("surface bowl: 3 edges (0-1, 0-2, 1-2)") &&
                                       ContainsSubstring("open"));
  }
  SECTION("crowded") {
    auto triangles = octahedron();
    for (Triangle const& t : {Triangle{0, 1, 6}, {1, 0, 7}}) triangles.push_back(t);
    SurfaceReport const report = check_surface(make_surface(triangles, object), "fan");
    CHECK(report.crowded == std::vector<Edge>{{0, 1}});
    CHECK(report.open.size() == 4);
    CHECK_THAT(report.warnings.at(1), ContainsSubstring("1 edge (0-1)"));
  }
  SECTION("twisted") {
    auto triangles = octahedron();
    std::swap(triangles[3][0], triangles[3][1]);
    SurfaceReport const report = check_surface(make_surface(triangles, object), "moebius");
    CHECK(report.twisted == std::vector<Edge>{{0, 1}, {0, 4}, {1, 4}});
    REQUIRE(report.warnings.size() == 1);
    CHECK_THAT(report.warnings[0], ContainsSubstring("opposite orientation"));
  }
  SECTION("repeated") {
    auto triangles = octahedron();
    triangles.push_back({2, 0, 1});
    SurfaceReport const report = check_surface(make_surface(triangles, object), "twice");
    CHECK(report.repeated == std::vector<std::size_t>{8});
    CHECK(report.crowded.size() == 3);
    CHECK_THAT(report.warnings.back(), ContainsSubstring("number 8"));
  }
}

TEST_CASE("triangles that are none are refused", "[contact]") {
  CHECK_THROWS_WITH(make_surface({{0, 1, 2}, {0, 1, 3}}, {0, 0, 0}),
                    ContainsSubstring("triangle 1 names vertex 3, but there are 3"));
  CHECK_THROWS_WITH(make_surface({{0, -1, 2}}, {0, 0, 0}), ContainsSubstring("vertex -1"));
  CHECK_THROWS_WITH(make_surface({{0, 1, 0}}, {0, 0, 0}), ContainsSubstring("(0, 1, 0)"));
  CHECK_THROWS_WITH(make_surface({{0, 1, 2}}, {4, 4, 5}), ContainsSubstring("bodies 4 and 5"));
}
