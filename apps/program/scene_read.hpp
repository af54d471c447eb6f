// The parts of a scene, from checked values to the structs of scene.hpp.
#pragma once

#include <taut/apps/program/scene.hpp>
#include <taut/apps/program/scene_value.hpp>

#include <fmt/format.h>

namespace taut {

inline constexpr double unbounded = std::numeric_limits<double>::infinity();
inline constexpr Range any_number{-unbounded, unbounded};
inline constexpr Range length_range{.min = 1e-9, .max = 1e9, .unit = "m"};
inline constexpr Range time_range{.min = 0, .max = 1e9, .unit = "s"};

double radians(double degrees);

/// A file named in a scene: relative to the scene's folder, then to TAUT_DATA_DIR. Throws Error
/// saying where it was looked for.
std::filesystem::path find_data(SceneValue const& value, std::string_view path,
                                std::filesystem::path const& scene_file);

enum class ShapeOf { object, obstacle };
/// Whether an object or obstacle has a shape; else it has a mesh. Throws Error for both and
/// neither.
bool has_shape(Section const& section);
/// A shape that meshes and material points share, its lengths times `scale`; nothing for another
/// `kind`. `common`: the keys that the table may have besides those of the kind.
std::optional<Shape> read_solid(Section const& shape, std::string_view kind,
                                std::vector<std::string_view> const& common, double scale = 1);
/// The table `shape`; `factor` is of its resolution.
ProceduralShape read_shape(Section const& shape, double factor, ShapeOf owner);
/// The keys `scale`, `rotate` and `translate`.
double read_scale(Section const& section);
RigidMap read_placement(Section const& section);
/// The keys `start` and `end`.
Window read_window(Section const& section);
/// The array `motion`: phases in order of time.
RigidMotion read_motion(Section const& section);

Selection read_selection(Section const& parent, std::filesystem::path const& scene_file);
/// One object, or all copies of it.
std::vector<SceneObject> read_object(Section const& section, Scene const& scene);
SceneObstacle read_obstacle(Section const& section, Scene const& scene);
/// The keys `young`, `poisson` and `density` of a material whose model is known; `base` gives those
/// that are left out, without it none may be. Throws Error where the model has no stable rest
/// state.
void read_elasticity(Section const& section, MaterialParameters& material,
                     MaterialParameters const* base = nullptr);
/// The table `velocity` of an object.
InitialVelocity read_velocity(Section const& section);
/// The ways from an object to its copies, itself among them; names are NAME-0, ... if `named`.
struct Copies {
  std::vector<Point> ways{Point{}};  ///< m
  bool named = false;
};
Copies read_copies(Section const& object);
/// The object at each of them. The centre of its velocity moves along.
template <class Object>
std::vector<Object> copies_of(Object const& object, Section const& section) {
  Copies const copies = read_copies(section);
  std::vector<Object> block;
  for (Point const& way : copies.ways) {
    Object copy = object;
    if (copies.named) copy.name = fmt::format("{}-{}", object.name, block.size());
    copy.placement.translation = copy.placement.translation + way;
    copy.velocity.centre = copy.velocity.centre + way;
    block.push_back(std::move(copy));
  }
  return block;
}
/// Everything that a scene of material points has besides what all scenes have.
ParticleScene read_particle_scene(Section const& root, Scene const& scene);
ScenePin read_pin(Section const& section, Scene const& scene);
SceneForce read_force(Section const& section, Scene const& scene);

}  // namespace taut
