// A scene: what is simulated, read from a TOML file (docs/scenes.md describes the keys) into plain
// data with every default filled in, every name resolved and every number in range.
#pragma once

#include <taut/apps/program/scene_motion.hpp>
#include <taut/apps/program/scene_options.hpp>
#include <taut/apps/program/scene_select.hpp>
#include <taut/core/fem/shapes.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace taut {

enum class TimeScheme { implicit_euler, bdf2, quasi_static };

struct MaterialParameters {
  std::string model;  ///< a name of `material_models()`
  double young;       ///< Pa
  double poisson;
  double density;  ///< kg/m^3
};

struct MaterialModel {
  std::string_view name;
  bool allows_inversion;  ///< defined for J <= 0
  std::string_view description;
};
std::span<MaterialModel const> material_models();
/// Those that are compiled for material points; the first is the default.
std::span<std::string_view const> particle_models();

/// v(x) = linear + w a x (x - centre); with a twist length L the rate w varies along the axis as
/// w sin(pi s / 2L), s = a . (x - centre).
struct InitialVelocity {
  Point linear{};                      ///< m/s
  Point axis{0, 1, 0};                 ///< unit vector a
  Point centre{};                      ///< m
  double angular_velocity = 0;         ///< rad/s
  std::optional<double> twist_length;  ///< m
};

/// Where an object's vertices are at time 0, other than at rest.
struct StartFlat {
  Point normal{0, 1, 0};       ///< unit vector
  std::optional<Point> point;  ///< m, on the plane; the centre of the object's box if not given
};
struct StartRandom {
  int seed = 1;
  std::optional<std::array<Point, 2>> box;  ///< m; the object's bounding box if not given
};
using Start = std::variant<std::monostate, StartFlat, StartRandom>;

struct SceneRegion {
  std::string where;  ///< "drag.toml:20: object.body.region.0", for messages
  Selection selection;
  MaterialParameters material;
};

struct ProceduralShape {
  Shape shape;
  int resolution;
};

struct SceneObject {
  std::string where;
  std::string name;
  std::string copy_of;  ///< its name in the file, by which pins and forces call all its copies
  std::variant<ProceduralShape, std::filesystem::path> geometry;
  double scale = 1;    ///< the mesh is scaled, then rotated about the origin, then translated
  RigidMap placement;  ///< rotation and translation
  InitialVelocity velocity;
  MaterialParameters material;
  std::vector<SceneRegion> regions;  ///< later ones win
  Start start;
};

/// What bodies touch, in a frame of its own: half of space, or a convex region that keeps them in.
struct HalfSpaceShape {
  Point point{};          ///< m, on its plane
  Point normal{0, 1, 0};  ///< unit vector, to where bodies are
};
struct InsideBoxShape {
  Point size;  ///< m, centred on the origin
};
struct InsideSphereShape {
  double radius;  ///< m, centred on the origin
};
struct InsideCylinderShape {
  double radius;  ///< m
  double height;  ///< m, along y, centred on the origin
};

/// What bodies touch and what is not simulated. The outside of a shape is a surface of triangles:
/// that of a procedural tet mesh, or an OBJ file.
struct SceneObstacle {
  std::string where;
  std::string name;
  std::variant<HalfSpaceShape, InsideBoxShape, InsideSphereShape, InsideCylinderShape,
               ProceduralShape,
               std::filesystem::path>
      geometry;                    ///< analytic ones are scaled already
  double scale = 1;                ///< of surfaces, before `placement`
  RigidMap placement;              ///< at time 0
  RigidMotion motion;              ///< from there
  std::optional<double> friction;  ///< coefficient between it and bodies; the scene's if not given

  /// Whether it is a surface of triangles.
  bool is_surface() const {
    return std::holds_alternative<ProceduralShape>(geometry) ||
           std::holds_alternative<std::filesystem::path>(geometry);
  }
};

/// Prescribed vertices. They follow `motion` from their rest position until the time of release.
struct ScenePin {
  std::string where;
  std::string name;
  std::vector<std::size_t> objects;
  Selection selection;
  RigidMotion motion;
  Window window;
};

struct SceneForce {
  enum class Kind {
    per_vertex,   ///< N at every selected vertex
    total,        ///< N, spread over the selected boundary faces by area
    acceleration  ///< m/s^2
  };
  std::string where;
  std::vector<std::size_t> objects;
  Selection selection;
  Kind kind;
  Point value;
  Window window;
};

/// What takes stresses that a material of points cannot bear away, after a step or, by the model,
/// in it (docs/scenes.md).
struct Plasticity {
  std::string kind = "none";  ///< a name of `plasticity_kinds()`
  double yield_stress = 0;    ///< of the metals, Pa
  double hardening = 0;       ///< of von_mises: Pa per plastic strain; of snow: psi
  double compression = 0, stretch = 0, least = 0, most = 0;  ///< of snow
  double angle = 0;                                          ///< of sand, degrees
};
std::span<std::string_view const> plasticity_kinds();

/// F of a particle at time 0 is diagonal, each entry random in this interval.
struct StartStretched {
  double least, most;
  int seed = 1;
};

/// A body of material points. Analytic solids have the sizes of shapes; a file is a closed surface
/// (.obj) or a level set (.vdb).
struct SceneBody {
  std::string where;
  std::string name;
  std::variant<Shape, std::filesystem::path> geometry;
  double scale = 1;    ///< scaled, then rotated about the origin, then translated
  RigidMap placement;  ///< rotation and translation
  InitialVelocity velocity;
  MaterialParameters material;
  Plasticity plasticity;
  double per_cell = 8;               ///< particles in a cell
  double max_holes = 0;              ///< share of the edges of a surface that may be at holes
  std::vector<std::string> without;  ///< names of bodies that are cut out of it
  std::optional<StartStretched> start;
};

/// Lets material points out: a cloud of them flows through a convex shape, and what leaves the
/// shape is there from then on. The nodes of the grid in it move with the flow.
struct SceneSource {
  std::string where;
  std::string name;
  Shape shape;         ///< a box, a ball or a cylinder, in a frame of its own
  RigidMap placement;  ///< at time 0
  RigidMotion motion;  ///< from there; turns the flow as well
  Point velocity;      ///< of the flow in the shape, as it is placed at time 0, m/s; not zero
  MaterialParameters material;
  Plasticity plasticity;
  double per_cell = 8;  ///< particles in a cell
  Window window;        ///< in which it flows
};

enum class BoundaryLaw { stick, slip, separate };

/// What holds the nodes of the grid: solid inside of its shape, or outside. A file is a closed
/// surface (.obj) or a level set (.vdb), which is solid inside.
struct SceneBoundary {
  std::string where;
  std::string name;
  std::variant<HalfSpaceShape, Shape, std::filesystem::path> shape;  ///< in a frame of its own
  double scale = 1;      ///< of a file; other shapes are scaled already
  double max_holes = 0;  ///< as of a body
  bool inside = false;   ///< the bodies are inside of it
  BoundaryLaw law = BoundaryLaw::stick;
  double friction = 0;
  RigidMap placement;             ///< at time 0
  RigidMotion motion;             ///< from there
  std::optional<double> release;  ///< s, when it is taken away; not of half spaces and containers
};

/// A scene of material points instead of meshes.
struct ParticleScene {
  double spacing = 0;                  ///< of the grid, m; holds the scene's resolution already
  std::string transfer = "apic";       ///< apic, rpic, flip
  double flip = 0.95;                  ///< of transfer = "flip"
  double cfl = 0.6, crossing = 1;      ///< cells (mpm/particle_stepper.hpp)
  double ghost_penalty = 0.01;         ///< strength (mpm/ghost_penalty.hpp); 0: none
  std::optional<double> longest_step;  ///< s; a frame if not given
  std::optional<double> time_error;  ///< of a step, m; steps are as long as the above allow without
  int halvings = 10;
  int seed = 1;  ///< of the places of particles
  bool check_overlap = true;
  std::vector<SceneBody> bodies;
  std::vector<SceneSource> sources;
  std::vector<SceneBoundary> boundaries;
};

struct OutputOptions {
  int every = 1;      ///< frames between written frames
  bool obj = false;   ///< also a surface per written frame
  bool vdb = false;   ///< also the grid of material points and their surface per written frame
  bool check = true;  ///< count inverted elements, or particles, after each step
};

/// A family of scenes: the override `key`=value for each of the values.
struct Sweep {
  std::string key;
  std::vector<double> values;
};

struct Scene {
  std::filesystem::path file;
  std::string name;
  std::string description;
  TimeScheme scheme = TimeScheme::implicit_euler;
  double step = 0;        ///< s
  int frames = 0;         ///< time steps
  Point gravity{};        ///< m/s^2
  double resolution = 1;  ///< factor of the resolution of every shape, which holds it already
  std::vector<SceneObject> objects;
  std::vector<SceneObstacle> obstacles;
  std::vector<ScenePin> pins;
  std::vector<SceneForce> forces;
  SolverOptions solver;
  std::optional<ContactOptions> contact;  ///< nothing keeps bodies apart without
  OutputOptions output;
  std::optional<Sweep> sweep;
  std::vector<std::string> warnings;
  std::optional<ParticleScene> particles;  ///< in place of objects, obstacles, pins and contact
};

struct SceneChanges {
  bool small = false;                  ///< lay the [small] table over the scene
  std::vector<std::string> overrides;  ///< "key.path=value", in order, after [small]
};

/// Reads and checks a scene, its [small] version and every member of its sweep. Mesh and mask files
/// must exist; what is in them is for build_geometry. Throws Error.
Scene load_scene(std::filesystem::path const& file, SceneChanges const& changes = {});

/// Name and description of a scene without looking for its data.
struct SceneTitle {
  std::string name;
  std::string description;
};
SceneTitle read_scene_title(std::filesystem::path const& file);

}  // namespace taut
