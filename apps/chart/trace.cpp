#include <taut/apps/chart/method.hpp>
#include <taut/apps/chart/trace.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/timer.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace taut {
namespace {

std::vector<std::string> const reference_solver{"solver.method=newton",
                                                "solver.precision=fp64",
                                                "solver.line_search=newton_armijo",
                                                "solver.refresh=always",
                                                "solver.stopping=decrement_window",
                                                "solver.tolerance=1e-12",
                                                "solver.max_iterations=1000",
                                                "solver.linear_tolerance=1e-3",
                                                "solver.max_linear_iterations=100000"};

/// Thrown by an observer that has seen enough; the state is then that before the step.
struct Enough {};

/// The state in the number types that the simulation keeps. (One of fp32 rounds it.)
void restore(Simulation& simulation, Checkpoint const& state) {
  Checkpoint own;
  simulation.save(own);
  for (auto& [name, array] : own.arrays) {
    if (auto* narrow = std::get_if<std::vector<float>>(&array)) {
      std::vector<double> const& wide = state.get<double>(name);
      std::transform(wide.begin(), wide.end(), narrow->begin(),
                     [](double number) { return static_cast<float>(number); });
    } else {
      array = state.arrays.at(name);
    }
  }
  simulation.restore(own);
}

char const* brief(Stop stop) {
  switch (stop) {
    case Stop::budget_iterations:
    case Stop::budget_seconds:
      return "budget";
    case Stop::stalled:
      return "stalled";
    case Stop::non_finite:
      return "not finite";
    default:
      return "converged";
  }
}

/// The energy is evaluated by a serial loop: at every early iteration, then ever more rarely.
bool is_sampled(std::size_t iteration) {
  std::size_t spacing = 1;
  while (iteration > 32 * spacing) spacing *= 2;
  return iteration % spacing == 0;
}

void record(Trace& trace, Simulation& simulation, StepMeasure const& measure,
            TraceLimits const& limits) {
  double const unknown = std::numeric_limits<double>::quiet_NaN();
  int const last_kept =
      limits.keep.empty() ? -1 : *std::max_element(limits.keep.begin(), limits.keep.end());
  auto const keeps = [&](int k) {
    return std::find(limits.keep.begin(), limits.keep.end(), k) != limits.keep.end();
  };
  std::vector<Point> end;
  if (last_kept >= 0) end = simulation.positions();
  if (keeps(0)) trace.kept[0] = end;
  Timer const timer;
  auto const observe = [&](IterationView const& view) {
    std::vector<Point> const x = view.positions();
    double const error = measure.position_error(x), residual = measure.residual(x);
    bool const accurate = error <= limits.lowest && !(residual >= limits.residual);
    bool const ends = accurate || timer.seconds() > limits.max_seconds;
    bool const sampled = ends || is_sampled(trace.points.size() + 1);
    trace.points.push_back({unknown, error, sampled ? measure.energy_gap(x) : unknown, residual});
    int const k = static_cast<int>(trace.points.size());
    if (keeps(k)) trace.kept[k] = x;
    if (k < last_kept) end = x;
    if (!ends) return;
    trace.ended = accurate ? "accurate" : "budget";
    throw Enough();
  };
  try {
    trace.ended = brief(simulation.step(observe).stop);
  } catch (Enough const&) {
  } catch (Error const&) {
    // The reference went through this step from the same state, so the scene is not to blame.
    trace.ended = "not finite";
  }
  for (int k : limits.keep) trace.kept.try_emplace(k, end);
}

void take_time(Trace& trace, Simulation& simulation) {
  std::size_t iteration = 0;
  Timer const timer;
  auto const observe = [&](IterationView const&) {
    double& seconds = trace.points[iteration].seconds;
    seconds = std::fmin(seconds, timer.seconds());
    if (++iteration == trace.points.size()) throw Enough();
  };
  try {
    simulation.step(observe);
  } catch (Enough const&) {
  }
}

}  // namespace

Scene reference_scene(std::filesystem::path const& scene, SceneChanges const& changes) {
  bool const particles = load_scene(scene, changes).particles.has_value();
  std::vector<std::string> solver = reference_solver;
  solver.push_back(particles ? "solver.preconditioner=multigrid"
                             : "solver.preconditioner=block_jacobi");
  return load_scene(scene, with(changes, solver));
}

ReferenceStep solve_reference(Simulation& simulation, Checkpoint const& before, int step) {
  ReferenceStep result;
  result.step = step;
  result.before = before;
  simulation.restore(before);
  result.start = simulation.positions();

  std::vector<Point> last = result.start, before_last = last;
  NewtonReport const report = simulation.step(
      [&](IterationView const& view) { before_last = std::exchange(last, view.positions()); });
  result.solution = simulation.positions();
  result.contact = simulation.contact();
  result.iterations = report.iterations;
  result.stop = report.stop;
  if (!report.converged() && report.stop != Stop::stalled) {
    throw Error("step {}: the reference does not converge ({}): compare another one with --frame",
                step, to_string(report.stop));
  }
  result.last_move = 0;
  for (std::size_t i = 0; i < last.size(); ++i)
    result.last_move = std::max(
        result.last_move, std::hypot(last[i][0] - before_last[i][0], last[i][1] - before_last[i][1],
                                     last[i][2] - before_last[i][2]));
  return result;
}

std::optional<int> Trace::reached(double target) const {
  std::size_t first = points.size();
  while (first > 0 && points[first - 1].position_error <= target) --first;
  if (first == points.size()) return {};
  return static_cast<int>(first) + 1;
}

std::optional<int> Trace::stopped_by(double tolerance) const {
  auto const below = [&](TracePoint const& p) { return p.residual < tolerance; };
  auto const first = std::find_if(points.begin(), points.end(), below);
  if (first == points.end()) return {};
  return static_cast<int>(first - points.begin()) + 1;
}

std::vector<int> linear_iterations(std::function<std::unique_ptr<Simulation>(int)> const& limited,
                                   ReferenceStep const& reference, std::size_t iterations,
                                   double max_seconds) {
  std::vector<int> all;
  Timer const timer;
  for (std::size_t k = 1; k <= iterations && timer.seconds() <= max_seconds; ++k) {
    auto const simulation = limited(static_cast<int>(k));
    restore(*simulation, reference.before);
    try {
      all.push_back(simulation->step().linear_iterations);
    } catch (Error const&) {
      break;
    }
    if (all.back() == 0) return {};
  }
  return all;
}

Trace trace(Simulation& simulation, ReferenceStep const& reference, StepMeasure const& measure,
            TraceLimits const& limits) {
  Trace trace;
  restore(simulation, reference.before);
  record(trace, simulation, measure, limits);
  for (int run = 0; run < limits.repetitions && !trace.points.empty(); ++run) {
    restore(simulation, reference.before);
    take_time(trace, simulation);
  }
  return trace;
}

}  // namespace taut
