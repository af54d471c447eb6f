// A scene made ready to be stepped: the discrete potential, the state and the minimiser, in the
// precision that the scene asks for. Everything that goes in and comes out is in the order of the
// points of the scene's result (result_mesh): of its mesh, or of its particles.
#pragma once

#include <taut/apps/program/scene_geometry.hpp>
#include <taut/contact/contact_report.hpp>
#include <taut/core/io/checkpoint.hpp>
#include <taut/integrators/newton.hpp>

#include <functional>
#include <memory>
#include <optional>

namespace taut {

/// One iteration of a minimiser, as charts see it.
struct IterationView {
  int index;                                      ///< 0 for the first
  double energy_change;                           ///< since the start of the step, kg m^2
  double error_estimate;                          ///< m
  std::function<std::vector<Point>()> positions;  ///< copies them; only if called
};
using IterationObserver = std::function<void(IterationView const&)>;

class Simulation {
public:
  virtual ~Simulation() = default;

  /// Discretises a scene of meshes (of material points: ParticleSimulation). Throws Error if it
  /// asks for what does not exist, starts with an inverted element of a material that forbids it,
  /// or has a body smaller than the distance of contact.
  static std::unique_ptr<Simulation> create(Scene const& scene, SceneGeometry const& geometry);

  /// One time step. Throws Error if the energy stops being a number, naming the elements, or if
  /// pins are held up, naming by what; the state is then that before the step.
  virtual NewtonReport step(IterationObserver const& observer = {}) = 0;

  virtual double time() const = 0;
  virtual int steps() const = 0;
  /// What contact amounts to now; nothing in a scene without.
  virtual std::optional<ContactReport> contact() const = 0;
  /// Of bodies, and behind them of the surfaces of obstacles and boundaries.
  virtual std::vector<Point> positions() const = 0;   ///< m
  virtual std::vector<Point> velocities() const = 0;  ///< m/s

  /// Everything that a run which goes on bitwise needs.
  virtual void save(Checkpoint& checkpoint) const = 0;
  virtual void restore(Checkpoint const& checkpoint) = 0;
};

/// Elements of the mesh with J <= 0 at positions x, ascending.
std::vector<std::int32_t> inverted_tets(TetMesh const& rest, std::vector<Point> const& x);

}  // namespace taut
