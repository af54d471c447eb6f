#include <taut/apps/chart/chart.hpp>
#include <taut/apps/chart/table.hpp>
#include <taut/apps/program/render_python.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/ranges.h>
#include <Kokkos_Core.hpp>

#include <algorithm>
#include <cmath>

namespace taut {

std::vector<Contestant> contestants(std::filesystem::path const& scene, SceneChanges const& changes,
                                    std::vector<ChartMethod> const& methods, int max_iterations) {
  std::vector<std::string> const rules{"solver.stopping=decrement_window", "solver.tolerance=1e-12",
                                       fmt::format("solver.max_iterations={}", max_iterations)};
  std::vector<Contestant> all;
  for (ChartMethod const& method : methods)
    all.push_back({method.label, load_scene(scene, with(with(changes, rules), method.overrides))});
  return all;
}

std::string describe(Scene const& scene, std::string const& size,
                     std::vector<MaterialParameters> const& of) {
  std::vector<std::string> materials;  // copies of an object have one each
  for (MaterialParameters const& m : of) {
    std::string text = fmt::format("{} (E = {:g} Pa, nu = {:g})", m.model, m.young, m.poisson);
    if (std::find(materials.begin(), materials.end(), text) == materials.end())
      materials.push_back(std::move(text));
  }
  constexpr char const* schemes[] = {"implicit Euler", "BDF2", "quasi-static"};
  return fmt::format(
      "# scene = {}\n{}# materials = {}\n# integrator = {}\n# step_s = {:g}\n# threads = {}\n",
      scene.name, size, fmt::join(materials, ", "), schemes[static_cast<int>(scene.scheme)],
      scene.step, Kokkos::DefaultExecutionSpace().concurrency());
}

std::string describe(Scene const& scene, SceneGeometry const& geometry) {
  return describe(scene,
                  fmt::format("# tets = {}\n# vertices = {}\n", geometry.mesh.tets.size(),
                              geometry.mesh.points.size()),
                  geometry.materials);
}

std::string describe_target(ChartOptions const& options, bool particles) {
  return fmt::format("# target = {:g}\n# length = {}\n{}", options.target,
                     options.length ? fmt::format("{:g} m", *options.length) : "motion",
                     particles ? fmt::format("# residual = {:g}\n", options.residual) : "");
}

std::string field(double number) {
  return std::isfinite(number) ? fmt::format("{:.6g}", number) : std::string();
}

std::string field(std::string const& text) {
  bool const plain = text.find_first_of(",\"\n\r") == std::string::npos && !text.starts_with('#');
  if (plain) return text;
  std::string quoted = "\"";
  for (char const c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

namespace {

/// What would only show after all is measured. Throws Error.
void check_options(ChartOptions const& options) {
  auto const require = [](bool holds, char const* option, auto value, char const* must) {
    if (!holds) throw Error("{} {}: it must be {}", option, value, must);
  };
  require(std::isfinite(options.target) && options.target > 0, "--target", options.target,
          "above 0");
  require(std::isfinite(options.residual) && options.residual > 0, "--residual", options.residual,
          "above 0");
  require(options.levels > 0 && options.levels <= 20, "--levels", options.levels, "1 to 20");
  for (int iteration : options.fields) require(iteration >= 0, "--fields", iteration, "0 or more");
  require(options.max_seconds > 0, "--seconds", options.max_seconds, "above 0");
  require(options.repetitions > 0, "--repetitions", options.repetitions, "at least 1");
  require(options.max_iterations > 0, "--iterations", options.max_iterations, "at least 1");
  if (options.length) {
    require(std::isfinite(*options.length) && *options.length > 0, "--length", *options.length,
            "above 0 m");
  }
}

/// What the charts of any kind leave in their folder, data.csv first; pictures if they are drawn.
std::vector<std::string> files_of_charts(bool drawn) {
  std::vector<std::string> files{"data.csv", "data.json", "frames.csv", "fields.csv",
                                 "patterns.csv"};
  if (!drawn) return files;
  for (std::string const name : {"chart", "residual", "frames", "fields", "fields_residual"})
    for (char const* ending : {".svg", ".png"}) files.push_back(name + ending);
  return files;
}

}  // namespace

int chart_command(ChartOptions const& options) {
  check_options(options);
  std::filesystem::path const scene = find_scene(options.scene.scene);
  std::filesystem::path const out =
      options.out.empty() ? std::filesystem::path("charts") / scene.stem() : options.out;
  std::filesystem::path const data = out / "data.csv";
  for (std::string const& file : files_of_charts(options.draw)) {
    if (options.force || !std::filesystem::exists(out / file)) continue;
    throw Error(
        "{}: a chart is there already ({}): choose another --out or replace it with --force",
        out.string(), file);
  }
  if (options.sweep + options.stability + options.totals + options.matrices > 1)
    throw Error("--sweep, --stability, --totals and --matrices: choose one");
  bool const compares =
      !options.sweep && !options.stability && !options.totals && !options.matrices;
  if ((!options.with.empty() && !compares && !options.totals) ||
      (options.without_contact && !compares)) {
    throw Error("--with and --without-contact are of a comparison: leave out --{}",
                options.sweep       ? "sweep"
                : options.stability ? "stability"
                : options.matrices  ? "matrices"
                                    : "totals");
  }
  if ((options.linear || !options.fields.empty()) && !compares) {
    throw Error("--linear and --fields are of a comparison of single steps");
  }
  if (!options.relative.empty() && !options.totals) {
    throw Error("--relative is of --totals: add it");
  }
  if (options.totals && !options.frames.empty()) {
    throw Error("--totals takes whole scenes: shorten them by --set time.frames=N, not by --frame");
  }
  if (!options.stability && !options.policies.empty()) {
    throw Error("--policies are what --stability compares: add it, or name --methods");
  }
  if (options.stability && !(options.methods.empty() && options.frames.empty())) {
    throw Error("--stability takes --policies instead of --methods and --frame");
  }
  bool const particles = load_scene(scene, options.scene.changes).particles.has_value();
  if (particles && options.stability) {
    throw Error("--stability is of policies of contact, which material points do not have");
  }
  if (options.matrices && !particles) {
    throw Error("--matrices is of levels over the grid of material points, which {} does not have",
                options.scene.scene);
  }
  if (options.matrices && !options.methods.empty()) {
    throw Error("--matrices looks at hierarchies, not at --methods: leave them out");
  }
  std::vector<ChartMethod> const methods = parse_methods(options.methods, particles);
  // A folder that cannot be written shows now and not when all is measured.
  std::filesystem::path const probe = out / ".taut";
  write_file_atomically(probe, "");
  std::filesystem::remove(probe);
  MoreTables more;
  std::string const table = options.stability  ? stability_of_policies(scene, options)
                            : options.matrices ? patterns_of_matrices(scene, options, more)
                            : options.totals   ? totals_of_methods(scene, options, methods, more)
                            : options.sweep    ? sweep_methods(scene, options, methods)
                                               : compare_methods(scene, options, methods, more);
  // What a chart of another kind has left would be drawn as if it were of this one.
  for (char const* name : {"frames.csv", "fields.csv", "patterns.csv"}) {
    std::filesystem::remove(out / name);
  }
  for (auto const& [name, text] : more) write_file_atomically(out / name, text);
  write_file_atomically(data, table);
  write_file_atomically(out / "data.json", to_json(table));
  fmt::print("data     {}, data.json", data.string());
  for (auto const& [name, text] : more) fmt::print(", {}", name);
  fmt::print("\n");
  if (options.draw) {
    run_drawing({"draw_chart.py", {"matplotlib"}, {"matplotlib>=3.7,<4"}},
                {data.string(), (out / "chart").string()}, data);
    fmt::print("chart    {}\n", (out / "chart.png").string());
  }
  return 0;
}

static bool const filled = chart_command_late.fill(chart_command);

}  // namespace taut
