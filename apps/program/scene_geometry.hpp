// The discrete scene: one mesh of all objects with what is prescribed on its vertices and tets, in
// the order of the objects and of their meshes.
#pragma once

#include <taut/apps/program/scene.hpp>
#include <taut/core/fem/tet_mesh.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace taut {

/// The vertices and tets of one object within the combined mesh.
struct ObjectPart {
  std::string name;
  std::int32_t first_vertex;
  std::int32_t vertices;
  std::int32_t first_tet;
  std::int32_t tets;
};

/// Vertices whose position is prescribed in every time step that `window` covers.
struct Pin {
  std::string name;
  std::vector<std::int32_t> vertices;  ///< ascending
  RigidMotion motion;
  Window window;

  /// Where a vertex with this rest position is held at time t, s.
  Point at(Point const& rest, double t) const { return motion.at(t)(rest); }
};

/// An external force in every time step that `window` covers: f_i = force[i] + m_i acceleration.
struct Force {
  std::vector<std::int32_t> vertices;  ///< ascending
  std::vector<Point> force;            ///< N, one per vertex of the list, or empty for none
  Point acceleration{};                ///< m/s^2
  Window window;
};

/// The triangles of an obstacle. Analytic ones are touched as what they are; theirs are for
/// pictures alone, and nothing collides with them.
struct ObstacleSurface {
  std::size_t obstacle;     ///< index into Scene::obstacles, which has its motion
  TriangleMesh mesh;        ///< at time 0, placed in the scene; closed ones oriented outward
  bool drawn_only = false;  ///< of an analytic obstacle
};

struct SceneGeometry {
  TetMesh mesh;                 ///< at rest, placed in the scene
  std::vector<Point> start;     ///< m, positions at time 0; pinned vertices start at rest
  std::vector<Point> velocity;  ///< m/s at time 0
  std::vector<ObjectPart> objects;
  std::vector<std::int32_t> object_of_tet;
  std::vector<std::int32_t> material_of_tet;
  std::vector<MaterialParameters> materials;
  std::vector<Pin> pins;  ///< no vertex is in two of them
  std::vector<Force> forces;
  std::vector<ObstacleSurface> obstacle_meshes;  ///< one for every obstacle, in their order
  std::vector<std::string> warnings;
};

/// Builds or reads the meshes and resolves all selections. Throws Error for a mesh that is not fit
/// for simulation, a selection without vertices or tets, a vertex held by two pins, and a surface
/// that cannot be an obstacle.
SceneGeometry build_geometry(Scene const& scene);

}  // namespace taut
