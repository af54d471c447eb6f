// The program `taut`: maps the command line onto the commands.
#include <taut/apps/chart/chart.hpp>
#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/late_part.hpp>
#include <taut/apps/program/parse_command_line.hpp>
#include <taut/apps/program/render.hpp>
#include <taut/core/io/hdf5.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>
#include <CLI/CLI.hpp>
#include <Kokkos_Core.hpp>

#include <filesystem>
#include <functional>
#include <map>
#include <string_view>

namespace {

using namespace taut;

/// A shorthand for --set KEY=VALUE.
void add_shorthand(CLI::App& command, SceneArguments& arguments, std::string const& option,
                   std::string const& key, std::string const& help) {
  command.add_option_function<std::string>(
      option,
      [&arguments, key](std::string const& value) {
        arguments.changes.overrides.push_back(key + "=" + value);
      },
      help + " (" + key + ")");
}

void add_scene(CLI::App& command, SceneArguments& arguments) {
  command.add_option("scene", arguments.scene, "a built-in scene (`taut scenes`) or a TOML file")
      ->capture_default_str();
  command
      .add_option("--set", arguments.changes.overrides,
                  "changes a key of the scene: --set solver.tolerance=1e-4; may be repeated")
      ->allow_extra_args(false);
  command.add_flag("--small", arguments.changes.small, "the small version of the scene");
  add_shorthand(command, arguments, "--resolution", "resolution",
                "factor of the resolution of every shape");
}

}  // namespace

int taut::run_program(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == "bench")
    return hand_over("taut_bench", argv + 1, "taut bench");
  hdf5::leave_files_at_exit();
  CLI::App app{"taut: implicit simulation of deformable solids", "taut"};
  app.set_version_flag("--version", "taut " TAUT_VERSION);
  app.footer("example: taut run drag --small --out /tmp/drag && taut render /tmp/drag");
  app.require_subcommand(1);
  app.set_help_all_flag("--help-all");
  int threads = 0;
  std::function<int()> command;

  RunOptions run;
  auto* run_app = app.add_subcommand("run", "steps a scene and writes its result");
  add_scene(*run_app, run.scene);
  add_shorthand(*run_app, run.scene, "--frames", "time.frames", "time steps");
  add_shorthand(*run_app, run.scene, "--method", "solver.method", "minimiser");
  add_shorthand(*run_app, run.scene, "--precision", "solver.precision", "fp64, mixed or fp32");
  run_app->add_option("--out", run.out, "folder of the result (results/NAME)");
  auto* force = run_app->add_flag("--force", run.force, "replaces a result that is there");
  run_app->add_flag("--restart", run.restart, "goes on from the checkpoint in --out")
      ->excludes(force);
  run_app
      ->add_option(
          "--check", run.check,
          "off, or ends at the first step, or iteration, that leaves an intersection (off)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, CheckRun>{
                                              {"off", CheckRun::off},
                                              {"every-step", CheckRun::every_step},
                                              {"every-iteration", CheckRun::every_iteration}})
                      .description("{off,every-step,every-iteration}"));
  run_app->footer("example: taut run stretch_twist --frames 100 --method newton --out /tmp/twist");
  run_app->callback([&] { command = [&] { return run_command(run); }; });

  auto* scenes_app = app.add_subcommand("scenes", "lists the built-in scenes");
  scenes_app->footer("example: taut scenes");
  scenes_app->callback([&] { command = scenes_command; });

  auto* methods_app = app.add_subcommand("methods", "lists minimisers and their parts");
  methods_app->footer("example: taut methods");
  methods_app->callback([&] { command = methods_command; });

  std::string checked;
  auto* check_app = app.add_subcommand(
      "check", "looks for inverted elements, values that are not finite and intersections");
  bool no_intersections = false;
  check_app->add_option("result", checked, "a folder that `taut run` wrote")->required();
  check_app->add_flag("--no-intersections", no_intersections,
                      "for bodies that may pass through each other: does not look for these");
  check_app->footer("example: taut check results/drag");
  check_app->callback([&] { command = [&] { return check_command(checked, !no_intersections); }; });

  std::vector<std::filesystem::path> tabled;
  auto* table_app = app.add_subcommand("table", "compares results, a row of Markdown each");
  table_app->add_option("results", tabled, "folders that `taut run` wrote")->required();
  table_app->footer("example: taut table results/*");
  table_app->callback([&] { command = [&] { return table_command(tabled); }; });

  SceneArguments plan;
  auto* plan_app = app.add_subcommand("plan", "says what a scene is composed of, and why");
  add_scene(*plan_app, plan);
  plan_app->footer("example: taut plan bimaterial");
  plan_app->callback([&] { command = [&] { return plan_command(plan); }; });

  ChartOptions chart;
  bool no_drawing = false;
  auto* chart_app = app.add_subcommand("chart", "draws error against iterations and seconds");
  add_scene(*chart_app, chart.scene);
  add_list(*chart_app, "--methods", chart.methods, "NAME[:KEY=VALUE...], KEY of [solver]; all");
  add_list(*chart_app, "--frame", chart.frames, "time steps to compare, from 1");
  add_list(*chart_app, "--with", chart.with, "other scenes in the same chart");
  chart_app->add_flag("--without-contact", chart.without_contact,
                      "also the same steps, from the same states, without contact");
  chart_app->add_flag("--sweep", chart.sweep, "time to --target against the scene's [sweep]");
  chart_app->add_flag("--totals", chart.totals, "the seconds of whole scenes");
  chart_app->add_option("--relative", chart.relative,
                        "one of the methods, whose seconds are the unit of --totals");
  chart_app->add_flag("--matrices", chart.matrices,
                      "how full the levels of hierarchies over material points are");
  chart_app->add_option("--levels", chart.levels, "of --matrices")->capture_default_str();
  chart_app->add_flag("--linear", chart.linear,
                      "also linear iterations up to each iteration, by many more runs");
  add_list(*chart_app, "--fields", chart.fields,
           "iterations whose errors and residuals are drawn point by point, from 0");
  chart_app->add_flag("--stability", chart.stability,
                      "how far --policies bring the scene until a step is not clean");
  add_list(*chart_app, "--policies", chart.policies,
           "KEY=VALUE[:KEY=VALUE...], KEY of [contact] or TABLE.KEY; default, paper; all");
  chart_app->add_option("--target", chart.target, "error that counts as solved")
      ->capture_default_str();
  chart_app
      ->add_option("--residual", chart.residual,
                   "of material points, the characteristic norm that counts as solved")
      ->capture_default_str();
  chart_app->add_option("--length", chart.length,
                        "m, what errors are relative to (the motion in the step)");
  chart_app->add_option("--iterations", chart.max_iterations, "at most")->capture_default_str();
  chart_app->add_option("--seconds", chart.max_seconds, "per method or policy, at most")
      ->capture_default_str();
  chart_app->add_option("--repetitions", chart.repetitions, "of timed runs")->capture_default_str();
  chart_app->add_option("--out", chart.out, "folder (charts/NAME)");
  chart_app->add_flag("--force", chart.force, "replaces a chart that is there");
  chart_app->add_flag("--no-drawing", no_drawing, "data.csv and data.json alone");
  chart_app->footer("example: taut chart drag --methods dk,lbfgs,newton");
  chart_app->callback([&] {
    chart.draw = !no_drawing;
    command = [&] { return chart_command_late("taut chart", chart); };
  });

  RenderOptions render;
  std::string rendered, pictures;
  auto* render_app = app.add_subcommand("render", "pictures and an animation of a result");
  render_app->add_option("result", rendered, "a folder that `taut run` wrote")->required();
  add_list(*render_app, "--frames", render.frames, "numbers or last");
  render_app->add_option("--colour", render.colour, "object, speed or displacement")
      ->capture_default_str();
  render_app->add_option("--animation", render.animation, "gif, mp4 or none")
      ->capture_default_str();
  render_app->add_option("--out", pictures, "folder (pictures, beside the result)");
  render_app->add_flag("--force", render.force, "replaces pictures that are there");
  render_app->footer("example: taut render results/drag --frames 0,75,last");
  render_app->callback([&] {
    render.result = rendered;
    render.out = pictures;
    command = [&] { return render_command(render); };
  });

  // For the list of commands: what follows it is for the other program.
  auto* bench_app = app.add_subcommand("bench", "measures kernels against the machine's limits");

  for (CLI::App* sub : app.get_subcommands({})) {
    if (sub == bench_app) continue;
    sub->add_option("--threads", threads, "threads to use (all)")->check(CLI::Range(1, 4096));
  }
  if (auto const status = parse_command_line(app, argc, argv)) return *status;

  Kokkos::InitializationSettings settings;
  settings.set_disable_warnings(true);
  if (threads > 0) settings.set_num_threads(threads);
  Kokkos::ScopeGuard const kokkos(settings);
  try {
    return ending_in_words(command);
  } catch (LeftToTheWhole const& part) {
    return hand_over("taut_whole", argv, part.what());
  }
}
