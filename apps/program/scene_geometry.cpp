#include <taut/apps/program/scene_geometry.hpp>
#include <taut/apps/program/scene_obstacle.hpp>
#include <taut/core/fem/mesh_check.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/first_few.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace taut {
namespace {

TetMesh unchecked_mesh(SceneObject const& object, std::vector<std::string>& warnings) {
  if (auto const* file = std::get_if<std::filesystem::path>(&object.geometry))
    return read_tet_mesh(*file, &warnings);
  auto const& [shape, resolution] = std::get<ProceduralShape>(object.geometry);
  try {
    return make_shape(shape, resolution);
  } catch (Error const& error) {
    throw Error("{}.shape: {}", object.where, error.what());
  }
}

TetMesh object_mesh(SceneObject const& object, std::vector<std::string>& warnings) {
  TetMesh mesh = unchecked_mesh(object, warnings);
  auto const* file = std::get_if<std::filesystem::path>(&object.geometry);
  MeshReport const report = check_mesh(mesh, file ? file->string() : object.where + ".shape");
  warnings.insert(warnings.end(), report.warnings.begin(), report.warnings.end());
  return mesh;
}

Point velocity_at(InitialVelocity const& v, Point const& x) {
  Point const arm = x - v.centre;
  double rate = v.angular_velocity;
  if (v.twist_length) rate *= std::sin(std::numbers::pi * dot(v.axis, arm) / (2 * *v.twist_length));
  return v.linear + rate * cross(v.axis, arm);
}

std::array<Point, 2> bounding_box(std::span<Point const> points) {
  std::array<Point, 2> box{points.front(), points.front()};
  for (Point const& x : points)
    for (std::size_t a = 0; a < 3; ++a) {
      box[0][a] = std::min(box[0][a], x[a]);
      box[1][a] = std::max(box[1][a], x[a]);
    }
  return box;
}

/// Moves the vertices of an object from rest to where they start.
struct MoveToStart {
  std::span<Point> points;

  void operator()(std::monostate) const {}
  void operator()(StartFlat const& flat) const {
    auto const box = bounding_box(points);
    Point const on_plane = flat.point.value_or(0.5 * (box[0] + box[1]));
    for (Point& x : points) x = x - dot(x - on_plane, flat.normal) * flat.normal;
  }
  void operator()(StartRandom const& random) const {
    auto const box = random.box.value_or(bounding_box(points));
    // The engine's bits are fixed by the standard, its distributions are not.
    std::mt19937_64 engine(static_cast<std::uint64_t>(random.seed));
    for (Point& x : points)
      for (std::size_t a = 0; a < 3; ++a) {
        double const unit = static_cast<double>(engine() >> 11) * 0x1p-53;
        x[a] = box[0][a] + unit * (box[1][a] - box[0][a]);
      }
  }
};

void assign_regions(SceneObject const& object, ObjectPart const& part, SceneGeometry& geometry) {
  if (object.regions.empty()) return;
  auto const tets =
      std::span(geometry.mesh.tets)
          .subspan(static_cast<std::size_t>(part.first_tet), static_cast<std::size_t>(part.tets));
  std::vector<Point> centroids;
  for (Tet const& tet : tets) {
    Point sum{};
    for (std::int32_t const v : tet) sum = sum + geometry.mesh.points[static_cast<std::size_t>(v)];
    centroids.push_back(0.25 * sum);
  }
  for (SceneRegion const& region : object.regions) {
    auto const inside = selected(region.selection, centroids);
    if (inside.empty())
      throw Error("{} selects no tet of '{}': move or widen the selection", region.where,
                  object.name);
    for (std::int32_t const t : inside)
      geometry.material_of_tet[static_cast<std::size_t>(part.first_tet + t)] =
          static_cast<std::int32_t>(geometry.materials.size());
    geometry.materials.push_back(region.material);
  }
}

/// Materials from number `first` on, of the object's tets from `part.first_tet` on.
void warn_of_locking(SceneObject const& object, ObjectPart const& part, std::size_t first,
                     SceneGeometry& geometry) {
  for (std::size_t m = first; m < geometry.materials.size(); ++m) {
    double const poisson = geometry.materials[m].poisson;
    if (!(poisson > 0.49)) continue;
    std::vector<std::int32_t> locking;
    for (std::int32_t t = 0; t < part.tets; ++t) {
      std::size_t const tet = static_cast<std::size_t>(part.first_tet + t);
      if (geometry.material_of_tet[tet] == static_cast<std::int32_t>(m)) locking.push_back(t);
    }
    geometry.warnings.push_back(fmt::format(
        "{}: {} of {} tets ({}) have a poisson of {}: linear tetrahedra lock above 0.49 and deform "
        "too little",
        object.where, locking.size(), part.tets, first_few(locking, 6), poisson));
  }
}

void add_object(SceneObject const& object, SceneGeometry& geometry) {
  TetMesh const mesh = object_mesh(object, geometry.warnings);
  TetMesh& all = geometry.mesh;
  constexpr std::size_t limit = std::numeric_limits<std::int32_t>::max();
  if (mesh.points.size() > limit - all.points.size() || mesh.tets.size() > limit - all.tets.size())
    throw Error("{}: the scene has more than {} vertices or tets: lower the resolution",
                object.where, limit);
  ObjectPart const part{object.name, static_cast<std::int32_t>(all.points.size()),
                        static_cast<std::int32_t>(mesh.points.size()),
                        static_cast<std::int32_t>(all.tets.size()),
                        static_cast<std::int32_t>(mesh.tets.size())};
  for (Point const& x : mesh.points) {
    all.points.push_back(object.placement(object.scale * x));
    geometry.velocity.push_back(velocity_at(object.velocity, all.points.back()));
  }
  for (Tet tet : mesh.tets) {
    for (std::int32_t& v : tet) v += part.first_vertex;
    all.tets.push_back(tet);
  }
  geometry.object_of_tet.resize(all.tets.size(),
                                static_cast<std::int32_t>(geometry.objects.size()));
  geometry.material_of_tet.resize(all.tets.size(),
                                  static_cast<std::int32_t>(geometry.materials.size()));
  std::size_t const first_material = geometry.materials.size();
  geometry.materials.push_back(object.material);
  assign_regions(object, part, geometry);
  warn_of_locking(object, part, first_material, geometry);

  geometry.start.insert(geometry.start.end(), all.points.begin() + part.first_vertex,
                        all.points.end());
  std::visit(
      MoveToStart{std::span(geometry.start).subspan(static_cast<std::size_t>(part.first_vertex))},
      object.start);
  geometry.objects.push_back(part);
}

/// The selected vertices of the given objects; refuses an empty selection.
std::vector<std::int32_t> selected_vertices(Selection const& selection,
                                            std::vector<std::size_t> const& objects,
                                            std::string const& where,
                                            SceneGeometry const& geometry) {
  std::vector<std::int32_t> vertices;
  for (std::size_t const o : objects) {
    ObjectPart const& part = geometry.objects[o];
    auto const points = std::span(geometry.mesh.points)
                            .subspan(static_cast<std::size_t>(part.first_vertex),
                                     static_cast<std::size_t>(part.vertices));
    for (std::int32_t const v : selected(selection, points))
      vertices.push_back(part.first_vertex + v);
  }
  if (vertices.empty()) throw Error("{} selects no vertex: move or widen the selection", where);
  return vertices;
}

void add_pins(Scene const& scene, SceneGeometry& geometry) {
  std::vector<std::int32_t> holder(geometry.mesh.points.size(), -1);
  for (ScenePin const& pin : scene.pins) {
    auto vertices = selected_vertices(pin.selection, pin.objects, pin.where, geometry);
    for (std::int32_t const v : vertices) {
      std::int32_t& held = holder[static_cast<std::size_t>(v)];
      if (held >= 0)
        throw Error("{} and {} both hold vertex {}: keep the selections of pins apart", pin.where,
                    geometry.pins[static_cast<std::size_t>(held)].name, v);
      held = static_cast<std::int32_t>(geometry.pins.size());
      geometry.start[static_cast<std::size_t>(v)] =
          geometry.mesh.points[static_cast<std::size_t>(v)];
    }
    geometry.pins.push_back({pin.name, std::move(vertices), pin.motion, pin.window});
  }
}

/// A force spread evenly over the boundary faces all of whose vertices are selected; a third of a
/// face's share goes to each of its vertices, as linear shape functions have it.
std::vector<Point> spread_over_faces(SceneForce const& force,
                                     std::vector<std::int32_t> const& vertices,
                                     std::vector<Triangle> const& faces,
                                     std::vector<Point> const& points) {
  std::vector<double> area(points.size(), -1);
  for (std::int32_t const v : vertices) area[static_cast<std::size_t>(v)] = 0;
  double total = 0;
  for (auto const& [a, b, c] : faces) {
    auto const i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b),
               k = static_cast<std::size_t>(c);
    if (area[i] < 0 || area[j] < 0 || area[k] < 0) continue;
    double const share = norm(cross(points[j] - points[i], points[k] - points[i])) / 6;
    for (std::size_t const v : {i, j, k}) area[v] += share;
    total += 3 * share;
  }
  if (!(total > 0))
    throw Error(
        "{} selects no whole face of the boundary to spread its total over: widen the "
        "selection or use per_vertex",
        force.where);
  std::vector<Point> spread;
  for (std::int32_t const v : vertices)
    spread.push_back((area[static_cast<std::size_t>(v)] / total) * force.value);
  return spread;
}

void add_forces(Scene const& scene, SceneGeometry& geometry) {
  std::vector<Triangle> faces;
  for (SceneForce const& force : scene.forces) {
    Force result;
    result.vertices = selected_vertices(force.selection, force.objects, force.where, geometry);
    result.window = force.window;
    if (force.kind == SceneForce::Kind::acceleration) {
      result.acceleration = force.value;
    } else if (force.kind == SceneForce::Kind::per_vertex) {
      result.force.assign(result.vertices.size(), force.value);
    } else {
      if (faces.empty()) faces = boundary_faces(geometry.mesh.tets);
      result.force = spread_over_faces(force, result.vertices, faces, geometry.mesh.points);
    }
    geometry.forces.push_back(std::move(result));
  }
}

void add_obstacles(Scene const& scene, SceneGeometry& geometry) {
  constexpr int cells_across = 16;  // of pictures
  for (std::size_t i = 0; i < scene.obstacles.size(); ++i) {
    SceneObstacle const& obstacle = scene.obstacles[i];
    bool const is_surface = obstacle.is_surface();
    geometry.obstacle_meshes.push_back(
        {i,
         is_surface ? obstacle_surface(obstacle, geometry.warnings)
                    : triangles_of(obstacle, bounding_box(geometry.start), cells_across),
         !is_surface});
  }
}

}  // namespace

SceneGeometry build_geometry(Scene const& scene) {
  if (scene.particles) {
    throw Error(
        "{}: the scene is made of material points ([grid]), and this command knows meshes alone: "
        "choose a scene without [grid]",
        scene.file.string());
  }
  SceneGeometry geometry;
  geometry.warnings = scene.warnings;
  for (SceneObject const& object : scene.objects) add_object(object, geometry);
  add_pins(scene, geometry);
  add_forces(scene, geometry);
  add_obstacles(scene, geometry);
  return geometry;
}

}  // namespace taut
