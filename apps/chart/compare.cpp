#include <taut/apps/chart/scene.hpp>
#include <taut/apps/chart/table.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>

namespace taut {
namespace {

/// What contact is worth in iterations: the same bodies pass through each other and obstacles.
Scene without_contact(Scene scene) {
  if (scene.particles) {
    throw Error("--without-contact: {} is of material points, which meet through their grid: {}",
                scene.name, "leave it out");
  }
  for (SceneObstacle const& obstacle : scene.obstacles) {
    if (!obstacle.is_surface()) continue;
    throw Error("--without-contact: {} is a mesh, whose vertices are in the state of the scene: {}",
                obstacle.where, "compare scenes whose obstacles are half spaces or walls");
  }
  scene.obstacles.clear();
  scene.contact.reset();
  return scene;
}

/// The rows of a chart, and what it says about the steps that they belong to.
class Comparison {
public:
  Comparison(std::filesystem::path const& first, ChartOptions const& options,
             std::vector<ChartMethod> const& methods)
      : options_(options), methods_(methods), files_{first} {
    for (std::string const& scene : options.with) files_.push_back(find_scene(scene));
    // Everything is checked before anything is measured.
    for (auto const& file : files_) load_contestants(file);
  }

  std::string run(MoreTables& more) {
    for (auto const& file : files_) {
      try {
        run(file);
      } catch (Error const& error) {
        // One of several must not cost what the others have taken.
        if (files_.size() == 1) throw;
        leave_out(load_scene(file, options_.scene.changes).name, error.what());
      }
    }
    if (rows_.empty()) throw Error("no scene can be compared; the last one: {}", last_error_);
    if (!options_.fields.empty()) {
      more["fields.csv"] = "scene,frame,method,iteration,x,y,z,error,residual\n" + fields_;
    }
    return header_ +
           "scene,frame,method,iteration,seconds,position_error,energy_gap,residual,"
           "linear_iterations,ended\n" +
           rows_;
  }

private:
  std::vector<Contestant> load_contestants(std::filesystem::path const& file) const {
    return contestants(file, options_.scene.changes, methods_, options_.max_iterations);
  }
  /// A method that does so many iterations and no more, whatever it was told.
  Scene limited(std::filesystem::path const& file, std::size_t method, int iterations) const {
    ChartMethod own = methods_[method];
    own.overrides.push_back(fmt::format("solver.max_iterations={}", iterations));
    return contestants(file, options_.scene.changes, {own}, iterations).front().scene;
  }

  void run(std::filesystem::path const& file) {
    Scene const scene = load_scene(file, options_.scene.changes);
    std::vector<Contestant> const all = load_contestants(file);
    std::unique_ptr<ChartScene> const steps = make_chart_scene(file, options_.scene.changes);
    header_ += header_.empty() ? "# kind = comparison\n" + steps->description() +
                                     describe_target(options_, scene.particles.has_value())
                               : fmt::format("# with = {}\n", scene.name);
    std::vector<int> frames = options_.frames;
    if (frames.empty()) frames = {std::min(10, scene.frames)};

    std::vector<Contestant> alone;
    std::unique_ptr<ChartScene> steps_alone;
    if (options_.without_contact) {
      for (Contestant const& one : all) alone.push_back({one.label, without_contact(one.scene)});
      steps_alone = make_chart_scene(file, options_.scene.changes, without_contact);
    }
    for (int frame : frames) {
      ReferenceStep const step = steps->advance_to(frame);
      compare(file, scene.name, *steps, all, step);
      if (!steps_alone) continue;
      compare(file, scene.name + " without contact", *steps_alone, alone,
              steps_alone->solve(step.before, frame));
    }
  }

  void leave_out(std::string const& name, std::string const& why) {
    last_error_ = why;
    header_ += fmt::format("# left_out = {}: {}\n", name, why);
    fmt::print(stderr, "taut: {} is left out: {}\n", name, why);
  }

  void compare(std::filesystem::path const& file, std::string const& name, ChartScene const& scene,
               std::vector<Contestant> const& all, ReferenceStep const& step) {
    std::unique_ptr<StepMeasure> const measure = scene.measure(step, options_.length);
    describe_step(name, step, *measure);
    fmt::print(
        "{} step {}: {}{}; errors relative to {:.4g} m; reference after {} iterations, its last "
        "one moved {:.1e}\n",
        name, step.step, scene.size(),
        step.contact ? fmt::format(", {} pairs in contact", step.contact->contacts) : "",
        measure->length(), step.iterations, step.last_move / measure->length());
    fmt::print("{:<26} {:>10} {:>10} {:>11} {:>11} {:>11}  ended\n", "",
               fmt::format("to {:g}", options_.target), "seconds", "frames/s", "last error",
               "iterations");
    for (std::size_t m = 0; m < all.size(); ++m) {
      auto const simulation = scene.contestant(all[m].scene);
      Trace const found = trace(*simulation, step, *measure,
                                {options_.lowest, options_.max_seconds, options_.repetitions,
                                 options_.residual, options_.fields});
      std::vector<int> linear;
      if (options_.linear) {
        auto const short_of = [&](int k) { return scene.contestant(limited(file, m, k)); };
        linear = linear_iterations(short_of, step, found.points.size(), options_.max_seconds);
      }
      std::string const label =
          fmt::format("{},{},{}", field(name), step.step, field(all[m].label));
      add_rows(label, found, linear);
      add_fields(label, step, *measure, found);
      say(all[m].label, found);
    }
  }

  void describe_step(std::string const& name, ReferenceStep const& step,
                     StepMeasure const& measure) {
    bool const one_state = files_.size() == 1 && !options_.without_contact;
    std::string const key = fmt::format("{}frame {}", one_state ? "" : name + " ", step.step);
    header_ += fmt::format(
        "# {0} length_m = {1:.6g}\n# {0} reference = newton fp64, {2} iterations, {3}\n"
        "# {0} reference_last_move = {4:.3g}\n",
        key, measure.length(), step.iterations, to_string(step.stop),
        step.last_move / measure.length());
    if (step.contact) {
      header_ += fmt::format("# {0} contacts = {1}\n# {0} smallest_gap = {2:.3g}\n", key,
                             step.contact->contacts, step.contact->smallest_gap);
    }
  }

  void add_rows(std::string const& label, Trace const& trace, std::vector<int> const& linear) {
    // A method that took no step at all still has a row to say so.
    if (trace.points.empty()) rows_ += fmt::format("{},0,,,,,,{}\n", label, trace.ended);
    for (std::size_t k = 0; k < trace.points.size(); ++k) {
      TracePoint const& p = trace.points[k];
      rows_ += fmt::format("{},{},{},{},{},{},{},{}\n", label, k + 1, field(p.seconds),
                           field(p.position_error), field(p.energy_gap), field(p.residual),
                           k < linear.size() ? std::to_string(linear[k]) : "",
                           k + 1 == trace.points.size() ? trace.ended : "");
    }
  }

  void add_fields(std::string const& label, ReferenceStep const& step, StepMeasure const& measure,
                  Trace const& trace) {
    for (auto const& [iteration, x] : trace.kept) {
      std::vector<double> const errors = measure.errors(x), residuals = measure.residuals(x);
      for (std::size_t i = 0; i < errors.size(); ++i) {
        Point const& at = step.start[i];
        fields_ +=
            fmt::format("{},{},{:.6g},{:.6g},{:.6g},{},{}\n", label, iteration, at[0], at[1], at[2],
                        field(errors[i]), residuals.empty() ? std::string() : field(residuals[i]));
      }
    }
  }

  void say(std::string const& label, Trace const& trace) const {
    std::string iterations = "-", seconds = "-", rate = "-";
    if (auto const k = trace.reached(options_.target)) {
      double const s = trace.points[*k - 1].seconds;
      iterations = std::to_string(*k);
      seconds = fmt::format("{:.4g}", s);
      rate = fmt::format("{:.3g}", 1 / s);
    }
    fmt::print(
        "{:<26} {:>10} {:>10} {:>11} {:>11} {:>11}  {}\n", label, iterations, seconds, rate,
        trace.points.empty() ? "-" : fmt::format("{:.2e}", trace.points.back().position_error),
        trace.points.size(), trace.ended);
  }

  ChartOptions const& options_;
  std::vector<ChartMethod> const& methods_;
  std::vector<std::filesystem::path> files_;
  std::string header_, rows_, fields_;
  std::string last_error_;  ///< of a scene that is left out
};

}  // namespace

std::string compare_methods(std::filesystem::path const& file, ChartOptions const& options,
                            std::vector<ChartMethod> const& methods, MoreTables& more) {
  return Comparison(file, options, methods).run(more);
}

}  // namespace taut
