#include <taut/apps/program/scene_result.hpp>

namespace taut {

ResultMesh result_mesh(Scene const& scene, SceneGeometry const& geometry) {
  ResultMesh result{{geometry.start, geometry.mesh.tets}, geometry.object_of_tet, {}};
  for (ObjectPart const& object : geometry.objects) {
    result.object_names.push_back(object.name);
    result.object_kind.push_back(ObjectKind::body);
  }
  std::vector<Point>& points = result.mesh.points;
  for (ObstacleSurface const& surface : geometry.obstacle_meshes) {
    auto const number = static_cast<std::int32_t>(result.object_names.size());
    auto const first = static_cast<std::int32_t>(points.size());
    result.object_names.push_back(scene.obstacles[surface.obstacle].name);
    result.object_kind.push_back(surface.drawn_only ? ObjectKind::drawn_only
                                                    : ObjectKind::obstacle);
    points.insert(points.end(), surface.mesh.points.begin(), surface.mesh.points.end());
    for (Triangle triangle : surface.mesh.triangles) {
      for (std::int32_t& v : triangle) v += first;
      result.triangles.push_back(triangle);
      result.object.push_back(number);
    }
  }
  return result;
}

}  // namespace taut
