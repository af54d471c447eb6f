#include <taut/apps/chart/scene.hpp>
#include <taut/apps/chart/table.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <limits>

namespace taut {

std::string sweep_methods(std::filesystem::path const& file, ChartOptions const& options,
                          std::vector<ChartMethod> const& methods) {
  Scene const whole = load_scene(file, options.scene.changes);
  if (!whole.sweep) {
    throw Error("{}: the scene has no [sweep]: give it a key and values, or leave --sweep out",
                file.string());
  }
  if (options.frames.size() > 1) throw Error("--frame: a sweep compares one frame, name one");
  int const frame = options.frames.empty() ? std::min(10, whole.frames) : options.frames.front();
  // A method has proven itself well below the target: an error may rise again.
  TraceLimits const limits{options.target / 10, options.max_seconds, options.repetitions,
                           options.residual};

  // One length for all members, the motion at the first value: what a stiff body still moves in a
  // step may be nothing against what every method has to undo of the predicted position.
  std::optional<double> length = options.length;
  std::string header,
      table =
          "value,method,iterations,seconds,position_error,residual_iterations,residual_seconds,"
          "residual,ended\n";
  for (double value : whole.sweep->values) {
    std::vector<std::string> const member{fmt::format("{}={}", whole.sweep->key, value)};
    SceneChanges const changes = with(options.scene.changes, member);
    std::vector<Contestant> const all = contestants(file, changes, methods, options.max_iterations);
    std::unique_ptr<ChartScene> const scene = make_chart_scene(file, changes);
    if (header.empty()) {
      header = "# kind = sweep\n" + scene->description() +
               describe_target(options, whole.particles.has_value()) +
               fmt::format("# key = {}\n# frame = {}\n", whole.sweep->key, frame);
    }
    ReferenceStep const step = scene->advance_to(frame);
    std::unique_ptr<StepMeasure> const measure = scene->measure(step, length);
    length = measure->length();
    if (value == whole.sweep->values.front()) {
      header += fmt::format("# length_m = {:.6g}\n", measure->length());
    }
    fmt::print("{}, step {}: errors relative to {:.4g} m\n", member[0], frame, measure->length());
    for (Contestant const& one : all) {
      auto const simulation = scene->contestant(one.scene);
      Trace const found = trace(*simulation, step, *measure, limits);
      auto const reached = found.reached(options.target);
      auto const stopped = found.stopped_by(options.residual);
      double const unknown = std::numeric_limits<double>::quiet_NaN();
      double const last = found.points.empty() ? unknown : found.points.back().position_error;
      auto const cost = [&](std::optional<int> const& k) {
        if (!k) return std::string(",");
        return fmt::format("{},{}", *k, field(found.points[*k - 1].seconds));
      };
      table += fmt::format(
          "{:g},{},{},{},{},{},{}\n", value, one.label, cost(reached), field(last), cost(stopped),
          field(found.points.empty() ? unknown : found.points.back().residual), found.ended);
      fmt::print("  {:<26} {}\n", one.label,
                 reached ? fmt::format("{} iterations, {:.4g} s", *reached,
                                       found.points[*reached - 1].seconds)
                         : fmt::format("not reached: {}, error {:.2e}", found.ended, last));
    }
  }
  return header + table;
}

}  // namespace taut
