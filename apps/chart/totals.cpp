#include <taut/apps/chart/scene.hpp>
#include <taut/apps/chart/table.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/timer.hpp>

#include <array>
#include <limits>

namespace taut {
namespace {

/// A run of a scene by one method.
struct Total {
  int frames = 0;
  int iterations = 0, linear_iterations = 0, converged = 0;
  double seconds = 0;
  std::string ended = "end of scene";
  std::vector<Point> end;
};

Total run(Simulation& simulation, int frames, double max_seconds) {
  Total total;
  while (total.frames < frames) {
    Timer const timer;
    try {
      NewtonReport const report = simulation.step();
      total.seconds += timer.seconds();
      total.iterations += report.iterations;
      total.linear_iterations += report.linear_iterations;
      total.converged += report.converged();
    } catch (Error const&) {
      total.ended = "no step";
      return total;
    }
    ++total.frames;
    if (total.frames < frames && total.seconds > max_seconds) {
      total.ended = "out of time";
      return total;
    }
  }
  if (total.converged < frames) total.ended = "not converged";
  total.end = simulation.positions();
  return total;
}

/// Runs of one scene.
class Totals {
public:
  Totals(std::filesystem::path const& file, ChartOptions const& options,
         std::vector<ChartMethod> const& methods)
      : options_(options), scene_(load_scene(file, options.scene.changes)) {
    for (ChartMethod const& method : methods) {
      all_.push_back(
          {method.label, load_scene(file, with(options.scene.changes, method.overrides))});
    }
    // The scene by its own method, a thousand times as accurate: what errors are measured from.
    std::array const exact{
        fmt::format("solver.tolerance={}", scene_.solver.number("tolerance") / 1e3)};
    exact_ = load_scene(file, with(options.scene.changes, exact));
    steps_ = make_chart_scene(file, options.scene.changes);
  }

  std::string description() const { return steps_->description(); }
  Scene const& scene() const { return scene_; }

  /// The rows.
  std::string run() const {
    auto const solver = steps_->whole(exact_);
    constexpr double patience = 20;  // for it, in times of the methods' seconds
    Total const reference = taut::run(*solver, scene_.frames, patience * options_.max_seconds);
    fmt::print("{}: {}, {} frames\n{:<26} {:>8} {:>10} {:>11} {:>11} {:>11}  ended\n", scene_.name,
               steps_->size(), scene_.frames, "", "frames", "seconds", "iterations", "linear",
               "error, m");
    std::string rows;
    for (Contestant const& one : all_) {
      auto const simulation = steps_->whole(one.scene);
      Total const total = taut::run(*simulation, scene_.frames, options_.max_seconds);
      bool const comparable = !total.end.empty() && !reference.end.empty();
      double const error = comparable ? largest_distance(total.end, reference.end)
                                      : std::numeric_limits<double>::quiet_NaN();
      rows += fmt::format("{},{},{},{},{},{},{},{},{},{}\n", scene_.name, one.label, total.frames,
                          scene_.frames, field(total.seconds), total.iterations,
                          total.linear_iterations, total.converged, field(error), total.ended);
      fmt::print("{:<26} {:>8} {:>10.4g} {:>11} {:>11} {:>11}  {}\n", one.label, total.frames,
                 total.seconds, total.iterations, total.linear_iterations,
                 comparable ? fmt::format("{:.2e}", error) : "-", total.ended);
    }
    return rows;
  }

private:
  ChartOptions const& options_;
  Scene scene_, exact_;
  std::vector<Contestant> all_;
  std::unique_ptr<ChartScene> steps_;
};

}  // namespace

std::string totals_of_methods(std::filesystem::path const& file, ChartOptions const& options,
                              std::vector<ChartMethod> const& methods) {
  std::vector<std::filesystem::path> files{file};
  for (std::string const& scene : options.with) files.push_back(find_scene(scene));
  // Everything is checked before anything is measured.
  std::vector<Totals> scenes;
  for (auto const& one : files) scenes.emplace_back(one, options, methods);
  std::string header = "# kind = totals\n" + scenes.front().description();
  for (std::size_t k = 1; k < scenes.size(); ++k)
    header += fmt::format("# with = {}\n", scenes[k].scene().name);
  header += fmt::format("# seconds_per_method = {:g}\n", options.max_seconds);
  std::string rows;
  for (Totals const& one : scenes) rows += one.run();
  return header +
         "scene,method,frames,of_frames,seconds,iterations,linear_iterations,converged_frames,"
         "error_m,ended\n" +
         rows;
}

}  // namespace taut
