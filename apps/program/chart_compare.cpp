#include <taut/apps/program/chart_table.hpp>
#include <taut/apps/program/chart_trace.hpp>
#include <taut/apps/program/memory.hpp>

#include <algorithm>

namespace taut {
namespace {

std::string describe(ReferenceStep const& reference, StepMeasure const& measure) {
  return fmt::format(
      "# frame {0} length_m = {1:.6g}\n# frame {0} reference = newton fp64, {2} iterations, {3}\n"
      "# frame {0} reference_last_move = {4:.3g}\n",
      reference.step, measure.length(), reference.iterations, to_string(reference.stop),
      reference.last_move / measure.length());
}

std::string rows(int frame, std::string const& label, Trace const& trace) {
  // A method that took no step at all still has a row to say so.
  if (trace.points.empty()) return fmt::format("{},{},0,,,,{}\n", frame, label, trace.ended);
  std::string text;
  for (std::size_t k = 0; k < trace.points.size(); ++k) {
    TracePoint const& p = trace.points[k];
    text += fmt::format("{},{},{},{},{},{},{}\n", frame, label, k + 1, field(p.seconds),
                        field(p.position_error), field(p.energy_gap),
                        k + 1 == trace.points.size() ? trace.ended : "");
  }
  return text;
}

void say(std::string const& label, Trace const& trace, double target) {
  std::string iterations = "-", seconds = "-";
  if (auto const k = trace.reached(target)) {
    iterations = std::to_string(*k);
    seconds = fmt::format("{:.4g}", trace.points[*k - 1].seconds);
  }
  fmt::print("{:<26} {:>10} {:>10} {:>11} {:>11}  {}\n", label, iterations, seconds,
             trace.points.empty() ? "-" : fmt::format("{:.2e}", trace.points.back().position_error),
             trace.points.size(), trace.ended);
}

}  // namespace

std::string compare_methods(std::filesystem::path const& file, ChartOptions const& options,
                            std::vector<ChartMethod> const& methods) {
  Scene const scene = load_scene(file, options.scene.changes);
  std::vector<Contestant> const all =
      contestants(file, options.scene.changes, methods, options.max_iterations);
  SceneGeometry const geometry = build_within_memory(scene);
  std::vector<int> frames = options.frames;
  if (frames.empty()) frames = {std::min(10, scene.frames)};

  std::string header =
      "# kind = comparison\n" + describe(scene, geometry) + describe_target(options);
  std::string table = "frame,method,iteration,seconds,position_error,energy_gap,ended\n";
  Reference reference(file, options.scene.changes, geometry);
  for (int frame : frames) {
    ReferenceStep const step = reference.advance_to(frame);
    StepMeasure const measure(scene, geometry, frame, step.start, step.solution, options.length);
    header += describe(step, measure);
    fmt::print(
        "{} step {}: {} tets; errors relative to {:.4g} m; reference after {} iterations, "
        "its last one moved {:.1e}\n",
        scene.name, frame, geometry.mesh.tets.size(), measure.length(), step.iterations,
        step.last_move / measure.length());
    fmt::print("{:<26} {:>10} {:>10} {:>11} {:>11}  ended\n", "",
               fmt::format("to {:g}", options.target), "seconds", "last error", "iterations");
    for (Contestant const& one : all) {
      auto const simulation = Simulation::create(one.scene, geometry);
      Trace const found = trace(*simulation, step, measure,
                                {options.lowest, options.max_seconds, options.repetitions});
      table += rows(frame, one.label, found);
      say(one.label, found, options.target);
    }
  }
  return header + table;
}

}  // namespace taut
