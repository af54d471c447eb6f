// What a chart needs of a scene, of meshes or of material points: the steps in which methods are
// compared, what their errors are measured with, and a simulation per method.
//
// With material points a step is the first one of the grid in a frame, seen by its nodes: what a
// minimiser solves. Errors are then those of the nodes in the norm of their masses, for a node that
// hardly any particle sees is of no account:
//
//   |x - x*|_M / length,   |d|_M^2 = Sum_i m_i |d_i|^2 / Sum_i m_i.
//
// Residuals of nodes are those of the potential in fp64 with the nodes that are held when the step
// begins; what walls hold or let go later, and friction, are not seen.
#pragma once

#include <taut/apps/chart/trace.hpp>

namespace taut {

class ChartScene {
public:
  virtual ~ChartScene() = default;

  /// Lines for the head of a chart.
  virtual std::string description() const = 0;
  /// "36224 tets"
  virtual std::string size() const = 0;

  /// Brings the scene to step number `step` by its own solver in fp64, and solves that by projected
  /// Newton in fp64 until no more can be gained. Throws Error if it is not ahead of the last one,
  /// or if the reference itself does not converge.
  virtual ReferenceStep advance_to(int step) = 0;
  /// Solves step number `step` from the state `before`. Throws Error if that does not converge.
  virtual ReferenceStep solve(Checkpoint const& before, int step) = 0;

  /// Throws Error if nothing moves in the step.
  virtual std::unique_ptr<StepMeasure> measure(ReferenceStep const& step,
                                               std::optional<double> length) const = 0;
  /// A method's own copy of the scene, whose step is that of the reference.
  virtual std::unique_ptr<Simulation> contestant(Scene const& scene) const = 0;
  /// The same, whose steps are frames.
  virtual std::unique_ptr<Simulation> whole(Scene const& scene) const = 0;
  /// Steps of the grid in the last frame of one of these; 1 for meshes.
  virtual int grid_steps(Simulation const& whole) const = 0;
};

/// `change` is applied to every scene that is loaded. Throws Error.
std::unique_ptr<ChartScene> make_chart_scene(std::filesystem::path const& file,
                                             SceneChanges const& changes,
                                             std::function<Scene(Scene)> const& change = {});

}  // namespace taut
