#include <taut/apps/chart/scene.hpp>
#include <taut/apps/chart/table.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/timer.hpp>

#include <algorithm>
#include <array>
#include <limits>

namespace taut {
namespace {

struct FrameCost {
  double seconds;
  int iterations, linear_iterations, grid_steps;
};

/// A run of a scene by one method.
struct Total {
  int frames = 0;
  std::vector<FrameCost> costs;
  int iterations = 0, linear_iterations = 0, converged = 0;
  double seconds = 0;
  std::string ended = whole;
  std::vector<Point> end;

  static constexpr char const* whole = "end of scene";
};

Total run(ChartScene const& scene, Simulation& simulation, int frames, double max_seconds) {
  Total total;
  while (total.frames < frames) {
    Timer const timer;
    try {
      NewtonReport const report = simulation.step();
      double const seconds = timer.seconds();
      total.costs.push_back(
          {seconds, report.iterations, report.linear_iterations, scene.grid_steps(simulation)});
      total.seconds += seconds;
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

  /// The rows. Adds to the costs of frames, and to `header` what errors are measured from.
  std::string run(std::string& costs, std::string& header, bool alone) const {
    auto const solver = steps_->whole(exact_);
    constexpr double patience = 20;  // for it, in times of the methods' seconds
    Total const reference =
        taut::run(*steps_, *solver, scene_.frames, patience * options_.max_seconds);
    bool const accurate = reference.ended == Total::whole;
    header +=
        fmt::format("# {}reference = {}, {} of {} frames, {}\n", alone ? "" : scene_.name + " ",
                    exact_.solver.text("method"), reference.frames, scene_.frames, reference.ended);
    if (!accurate)
      fmt::print(stderr, "taut: {}: the reference has {}: no errors\n", scene_.name,
                 reference.ended);
    fmt::print("{}: {}, {} frames\n{:<26} {:>8} {:>10} {:>11} {:>11} {:>11}  ended\n", scene_.name,
               steps_->size(), scene_.frames, "", "frames", "seconds", "iterations", "linear",
               "error, m");
    std::string rows;
    for (Contestant const& one : all_) {
      auto const simulation = steps_->whole(one.scene);
      Total const total = taut::run(*steps_, *simulation, scene_.frames, options_.max_seconds);
      int grid_steps = 0;
      for (std::size_t f = 0; f < total.costs.size(); ++f) {
        FrameCost const& cost = total.costs[f];
        grid_steps += cost.grid_steps;
        costs += fmt::format("{},{},{},{},{},{},{}\n", field(scene_.name), field(one.label), f + 1,
                             field(cost.seconds), cost.iterations, cost.linear_iterations,
                             cost.grid_steps);
      }
      bool const comparable = !total.end.empty() && accurate;
      double const error = comparable ? largest_distance(total.end, reference.end)
                                      : std::numeric_limits<double>::quiet_NaN();
      rows += fmt::format("{},{},{},{},{},{},{},{},{},{},{}\n", field(scene_.name),
                          field(one.label), total.frames, scene_.frames, field(total.seconds),
                          total.iterations, total.linear_iterations, total.converged, grid_steps,
                          field(error), total.ended);
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
                              std::vector<ChartMethod> const& methods, MoreTables& more) {
  std::vector<std::filesystem::path> files{file};
  for (std::string const& scene : options.with) files.push_back(find_scene(scene));
  // Everything is checked before anything is measured.
  std::vector<Totals> scenes;
  for (auto const& one : files) scenes.emplace_back(one, options, methods);
  std::string header = "# kind = totals\n" + scenes.front().description();
  for (std::size_t k = 1; k < scenes.size(); ++k)
    header += fmt::format("# with = {}\n", scenes[k].scene().name);
  header += fmt::format("# seconds_per_method = {:g}\n", options.max_seconds);
  if (!options.relative.empty()) {
    ChartMethod const unit =
        parse_method(options.relative, scenes.front().scene().particles.has_value());
    bool const runs = std::any_of(methods.begin(), methods.end(), [&](ChartMethod const& method) {
      return method.label == unit.label;
    });
    if (!runs) throw Error("--relative {}: it is none of the --methods: add it", options.relative);
    header += fmt::format("# relative_to = {}\n", unit.label);
  }
  std::string rows, &costs = more["frames.csv"];
  costs = "scene,method,frame,seconds,iterations,linear_iterations,grid_steps\n";
  for (Totals const& one : scenes) rows += one.run(costs, header, scenes.size() == 1);
  return header +
         "scene,method,frames,of_frames,seconds,iterations,linear_iterations,converged_frames,"
         "grid_steps,error_m,ended\n" +
         rows;
}

}  // namespace taut
