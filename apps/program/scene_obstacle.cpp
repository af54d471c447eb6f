#include <taut/apps/program/scene_obstacle.hpp>
#include <taut/contact/surface.hpp>
#include <taut/core/fem/mesh_check.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace taut {
namespace {

TriangleMesh procedural_surface(ProceduralShape const& geometry, std::string const& where) {
  TetMesh mesh;
  try {
    mesh = make_shape(geometry.shape, geometry.resolution);
  } catch (Error const& error) {
    throw Error("{}.shape: {}", where, error.what());
  }
  check_mesh(mesh, where + ".shape");  // also turns tets given one by one the right way round
  return boundary_surface(mesh);
}

/// Vertices that no triangle names are dropped: contact would not see them.
void drop_unused(TriangleMesh& mesh) {
  std::vector<std::int32_t> number(mesh.points.size(), -1);
  for (Triangle const& triangle : mesh.triangles)
    for (std::int32_t const v : triangle) number[static_cast<std::size_t>(v)] = 0;
  std::size_t used = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] < 0) continue;
    mesh.points[used] = mesh.points[v];
    number[v] = static_cast<std::int32_t>(used++);
  }
  mesh.points.resize(used);
  for (Triangle& triangle : mesh.triangles)
    for (std::int32_t& v : triangle) v = number[static_cast<std::size_t>(v)];
}

/// Of a closed surface; from a vertex of it, for far from the origin all digits would cancel.
double volume(TriangleMesh const& mesh) {
  Point const& origin = mesh.points.front();
  auto const from_origin = [&](std::int32_t v) {
    return mesh.points[static_cast<std::size_t>(v)] - origin;
  };
  double sum = 0;
  for (auto const& [a, b, c] : mesh.triangles)
    sum += dot(from_origin(a), cross(from_origin(b), from_origin(c))) / 6;
  return sum;
}

void require_areas(TriangleMesh const& mesh, std::string const& name) {
  if (mesh.triangles.empty()) throw Error("{} has no triangles: export its surface", name);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    auto const& [a, b, c] = mesh.triangles[t];
    Point const& x = mesh.points[static_cast<std::size_t>(a)];
    Point const u = mesh.points[static_cast<std::size_t>(b)] - x;
    Point const v = mesh.points[static_cast<std::size_t>(c)] - x;
    double const longest = std::max({dot(u, u), dot(v, v), dot(u - v, u - v)});
    if (!(norm(cross(u, v)) > 1e-12 * longest))
      throw Error("{}: triangle {} (of vertices {}, {}, {}) has no area: remove it", name, t, a, b,
                  c);
  }
}

TriangleMesh surface_of_file(std::filesystem::path const& file,
                             std::vector<std::string>& warnings) {
  std::string const name = file.string();
  TriangleMesh mesh = read_obj(file);
  require_areas(mesh, name);
  drop_unused(mesh);
  std::vector<int> const one_object(mesh.points.size(), 0);
  SurfaceReport const report = check_surface(make_surface(mesh.triangles, one_object), name);
  warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
  bool const closed = report.open.empty() && report.crowded.empty() && report.twisted.empty();
  if (closed && volume(mesh) < 0) {
    for (Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
    warnings.push_back(name + ": its triangles were oriented inward and have been turned round");
  }
  return mesh;
}

void place(TriangleMesh& mesh, double scale, RigidMap const& placement) {
  for (Point& x : mesh.points) x = placement(scale * x);
}

/// The wall of a region that keeps bodies inside.
TriangleMesh wall(Shape const& shape, int resolution, RigidMap const& placement) {
  TriangleMesh mesh = boundary_surface(make_shape(shape, resolution));
  for (Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  place(mesh, 1, placement);
  return mesh;
}

/// Two unit vectors that with `normal` are a right-handed frame.
std::array<Point, 2> tangents(Point const& normal) {
  std::size_t least = 0;
  for (std::size_t a = 1; a < 3; ++a)
    if (std::abs(normal[a]) < std::abs(normal[least])) least = a;
  Point axis{};
  axis[least] = 1;
  Point const across = cross(axis, normal);
  Point const first = (1 / norm(across)) * across;
  return {first, cross(normal, first)};
}

struct Draw {
  SceneObstacle const& obstacle;
  std::array<Point, 2> const& around;
  int resolution;

  TriangleMesh operator()(HalfSpaceShape const& half) const {
    RigidMap turn = obstacle.placement;
    turn.translation = {};
    Point const normal = turn(half.normal), on_plane = obstacle.placement(half.point);
    Point const centre = 0.5 * (around[0] + around[1]);
    Point const foot = centre - dot(centre - on_plane, normal) * normal;
    auto const [u, v] = tangents(normal);
    double const diagonal = norm(around[1] - around[0]);
    double const cell = 2 * (diagonal > 0 ? diagonal : 1) / resolution;
    TriangleMesh mesh;
    for (int i = 0; i <= resolution; ++i)
      for (int j = 0; j <= resolution; ++j)
        mesh.points.push_back(foot + (i - resolution / 2.0) * cell * u +
                              (j - resolution / 2.0) * cell * v);
    for (std::int32_t i = 0; i < resolution; ++i)
      for (std::int32_t j = 0; j < resolution; ++j) {
        std::int32_t const row = resolution + 1, corner = i * row + j;
        mesh.triangles.push_back({corner, corner + row, corner + row + 1});
        mesh.triangles.push_back({corner, corner + row + 1, corner + 1});
      }
    return mesh;
  }
  TriangleMesh operator()(InsideBoxShape const& box) const {
    return wall(BoxShape{box.size}, resolution, obstacle.placement);
  }
  TriangleMesh operator()(InsideSphereShape const& sphere) const {
    return wall(SphereShape{sphere.radius}, resolution, obstacle.placement);
  }
  TriangleMesh operator()(InsideCylinderShape const& cylinder) const {
    return wall(CylinderShape{cylinder.radius, cylinder.height, 1}, resolution, obstacle.placement);
  }
  template <class Surface>
  TriangleMesh operator()(Surface const&) const {
    std::vector<std::string> told_when_built;
    return obstacle_surface(obstacle, told_when_built);
  }
};

}  // namespace

TriangleMesh obstacle_surface(SceneObstacle const& obstacle, std::vector<std::string>& warnings) {
  auto const* file = std::get_if<std::filesystem::path>(&obstacle.geometry);
  TriangleMesh mesh =
      file ? surface_of_file(*file, warnings)
           : procedural_surface(std::get<ProceduralShape>(obstacle.geometry), obstacle.where);
  place(mesh, obstacle.scale, obstacle.placement);
  return mesh;
}

TriangleMesh triangles_of(SceneObstacle const& obstacle, std::array<Point, 2> const& around,
                          int resolution) {
  return std::visit(Draw{obstacle, around, std::max(1, resolution)}, obstacle.geometry);
}

}  // namespace taut
