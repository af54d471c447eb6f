// A scene of material points made ready to be stepped. A step of the program is a frame of the
// scene, time.step seconds, which takes as many steps of the grid as its particles ask for.
#pragma once

#include <taut/apps/program/late_part.hpp>
#include <taut/apps/program/particle_geometry.hpp>
#include <taut/apps/program/simulation.hpp>
#include <taut/mpm/grid_output.hpp>

namespace taut {

/// What a frame took besides what its minimiser reports.
struct ParticleFrame {
  int steps = 0;            ///< of the grid
  int halvings = 0;         ///< of these, in all
  int converged_steps = 0;  ///< of these
  int unsettled_steps = 0;  ///< of these, ParticleStepReport::unsettled
  int nodes = 0;            ///< the most that the grid had
  double travel_cells = 0;  ///< the farthest that a particle went in a step of the grid (a bound)
};

/// The nodes of a step of the grid.
struct NodesOfStep {
  std::vector<Point> x;      ///< m
  std::vector<double> mass;  ///< kg
};

class ParticleSimulation : public Simulation {
public:
  /// Throws Error if the scene asks for what does not exist.
  static std::unique_ptr<ParticleSimulation> create(Scene const& scene,
                                                    SceneParticles const& particles);

  /// Of the frame that ended last.
  virtual ParticleFrame const& frame() const = 0;
  /// Those that are there, in the order of SceneParticles::list.
  virtual std::vector<Particle> particles() const = 0;
  virtual std::size_t particle_count() const = 0;
  /// The first step of the grid that the next frame takes, for charts; what comes after it is not
  /// taken, and the frame is not counted.
  virtual NewtonReport first_step(IterationObserver const& observer) = 0;
  /// Of the step that was taken last; and at rest, of that to come.
  virtual NodesOfStep nodes() const = 0;
  virtual NodesOfStep start_nodes() = 0;
  /// Of nodes at x in the step of the grid that was begun last, before its end: the force that is
  /// left at each, over the characteristic one (integrators/characteristic_norm.hpp); 0 where
  /// there is none. Their root mean square is the norm that HOT stops by.
  virtual std::vector<double> characteristic_residuals(std::vector<Point> const& x) const = 0;
  /// Of each point of the scene's result (result_mesh), in the order of particle_scalars().
  virtual std::vector<std::vector<double>> scalars() const = 0;
  /// The grid of the last step, none before the first, and the particles as they are.
  virtual GridOutput grid() const = 0;
};

/// Particles with J <= 0, or of which something is not a number, ascending.
std::vector<std::size_t> broken_particles(std::vector<Particle> const& particles);

/// write_grid, which takes long to compile.
inline constinit LatePart<void(std::filesystem::path const&, GridOutput const&)> write_grid_late;

}  // namespace taut
