// One time step by one method, seen against the step's solution after every iteration.
#pragma once

#include <taut/apps/chart/measure.hpp>
#include <taut/apps/program/simulation.hpp>

#include <limits>
#include <map>
#include <optional>

namespace taut {

/// A step of a scene: the state that every method starts from, and where it should end.
struct ReferenceStep {
  int step;                  ///< number, from 1; of material points, of the frame that it begins
  Checkpoint before;         ///< fp64
  std::vector<Point> start;  ///< positions in `before`; of material points, of the nodes at rest
  std::vector<Point> solution;
  int iterations;
  Stop stop;
  double last_move;  ///< m, of the reference's last iteration: what it can tell apart
  std::optional<ContactReport> contact;  ///< at the solution
};

/// The scene with its solver replaced by that of the reference.
Scene reference_scene(std::filesystem::path const& scene, SceneChanges const& changes);

/// Solves step number `step` from the state `before` with the simulation of a reference_scene.
/// Throws Error if that does not converge.
ReferenceStep solve_reference(Simulation& simulation, Checkpoint const& before, int step);

struct TracePoint {
  double seconds;         ///< from the beginning of the step, the fastest of all runs
  double position_error;  ///< see StepMeasure
  double energy_gap;      ///< NaN where it was not evaluated
  double residual;        ///< NaN where there is none
};

struct TraceLimits {
  double lowest = 0;        ///< position error that ends the step,
  double max_seconds = 60;  ///< of the run whose errors are recorded
  int repetitions = 3;      ///< runs that are timed
  /// if the residual is below this, too, where there is one.
  double residual = std::numeric_limits<double>::infinity();
  std::vector<int> keep = {};  ///< iterations of which all points are kept, 0 for the start
};

struct Trace {
  std::vector<TracePoint> points;  ///< after iterations 1, 2, ...
  /// "accurate" if `lowest` was reached, else what ended the step: "budget", "stalled", "not
  /// finite", "converged" by the method's own rule.
  std::string ended;

  std::map<int, std::vector<Point>> kept;  ///< after its end, iterations show that

  /// The first iteration (from 1) from which on the error of position stays at or below `target`.
  std::optional<int> reached(double target) const;
  /// The first iteration (from 1) after which the residual is below `tolerance`: where it would
  /// have been stopped.
  std::optional<int> stopped_by(double tolerance) const;
};

/// Runs the step once with its errors recorded, and then without, for the time: its observer then
/// reads a clock and nothing else.
Trace trace(Simulation& simulation, ReferenceStep const& reference, StepMeasure const& measure,
            TraceLimits const& limits);

/// What methods that solve linear systems took for them up to each of the first `iterations`
/// iterations: products with the Hessian. Reports have one sum for a step, so the step is taken
/// anew up to each, by `limited(k)`, a simulation of no more than k iterations. Empty if there are
/// none to count; ends early after `max_seconds`.
std::vector<int> linear_iterations(std::function<std::unique_ptr<Simulation>(int)> const& limited,
                                   ReferenceStep const& reference, std::size_t iterations,
                                   double max_seconds);

}  // namespace taut
