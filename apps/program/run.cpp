// `taut run`: steps a scene and writes its result, report and checkpoints.
#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/memory.hpp>
#include <taut/apps/program/methods.hpp>
#include <taut/apps/program/simulation.hpp>
#include <taut/core/io/checkpoint.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/progress.hpp>
#include <taut/core/report/report_log.hpp>
#include <taut/core/report/timer.hpp>

#include <fmt/core.h>

#include <csignal>
#include <fstream>
#include <optional>
#include <sstream>

namespace taut {

namespace {

std::sig_atomic_t volatile interrupted = 0;
void interrupt(int signal) { interrupted = signal; }

/// Ctrl-C and TERM end a run after the step in progress.
class Signals {
public:
  Signals() {
    interrupted = 0;
    before_int_ = std::signal(SIGINT, interrupt);
    before_term_ = std::signal(SIGTERM, interrupt);
  }
  ~Signals() {
    std::signal(SIGINT, before_int_);
    std::signal(SIGTERM, before_term_);
  }

private:
  void (*before_int_)(int);
  void (*before_term_)(int);
};

/// What of a scene decides its course: a checkpoint of one text does not fit another. The number of
/// frames may change, so that a run can be prolonged.
std::string scene_text(Scene const& scene, SceneChanges const& changes) {
  std::ifstream file(scene.file);
  std::ostringstream text;
  text << file.rdbuf() << "\nsmall = " << changes.small << "\n";
  for (std::string const& change : changes.overrides) {
    if (!change.starts_with("time.frames=")) text << change << "\n";
  }
  return text.str();
}

class Run {
public:
  Run(Scene const& scene, SceneGeometry const& geometry, RunOptions const& options)
      : scene_(scene),
        geometry_(geometry),
        folder_(options.out.empty() ? std::filesystem::path("results") / scene.name : options.out),
        text_(scene_text(scene, options.scene.changes)),
        simulation_(Simulation::create(scene, geometry)) {
    if (options.restart) {
      Checkpoint const checkpoint = read_checkpoint(folder_ / "checkpoint.h5", text_);
      simulation_->restore(checkpoint);
      std::int64_t const written = checkpoint.number<std::int32_t>("frames_written");
      result_.emplace(ResultWriter::resume(result_path(), result_mesh(), written, capacity()));
    } else {
      if (!options.force && std::filesystem::exists(result_path())) {
        throw Error(
            "{}: a result is there already: choose another --out, continue it with --restart or "
            "replace it with --force",
            folder_.string());
      }
      result_.emplace(ResultWriter::create(
          result_path(), result_mesh(), capacity(),
          options.force ? ResultWriter::IfExists::replace : ResultWriter::IfExists::refuse));
      write_frame();
    }
    // Line k of the report is step k, counted from 1.
    log_.emplace(folder_ / "report.jsonl", options.restart ? simulation_->steps() + 1 : 0);
  }

  int run() {
    int const first = simulation_->steps();
    ProgressLine progress(scene_.frames, "frames", first);
    Timer since_checkpoint;
    Signals const signals;
    try {
      while (simulation_->steps() < scene_.frames && !interrupted) {
        step();
        if (simulation_->steps() % scene_.output.every == 0) write_frame();
        if (since_checkpoint.seconds() > 10) {
          checkpoint();
          since_checkpoint.restart();
        }
        progress.update(simulation_->steps(), note_);
      }
    } catch (Error const&) {
      progress.finish();
      checkpoint();
      summarise("stopped by an error");
      throw;
    }
    progress.finish();
    checkpoint();
    summarise(interrupted ? "interrupted" : "finished");
    say_where(first);
    return interrupted ? 128 + interrupted : 0;
  }

private:
  std::filesystem::path result_path() const { return folder_ / "result.vtkhdf"; }
  std::int64_t capacity() const { return scene_.frames / scene_.output.every + 1; }

  ResultMesh result_mesh() const {
    ResultMesh mesh{geometry_.mesh, geometry_.object_of_tet, {}};
    mesh.mesh.points = geometry_.start;
    for (ObjectPart const& object : geometry_.objects) mesh.object_names.push_back(object.name);
    return mesh;
  }

  void step() {
    Timer const timer;
    NewtonReport const r = simulation_->step();
    seconds_ += timer.seconds();
    ++steps_;
    iterations_ += r.iterations;
    converged_ += r.converged();
    restarts_ += r.restarts.total();
    Record line;
    line.set("frame", simulation_->steps())
        .set("time", simulation_->time())
        .set("stop", std::string(to_string(r.stop)))
        .set("converged", r.converged())
        .set("iterations", r.iterations)
        .set("error_estimate_m", r.error_estimate_m)
        .set("error_estimate_mps", r.error_estimate_mps)
        .set("error_floor_m", r.error_floor_m)
        .set("energy_change", r.energy_change)
        .set("gradient_norm_m", r.gradient_norm)
        .set("restarts", Record()
                             .set("not_descent", r.restarts.not_descent)
                             .set("curvature", r.restarts.curvature)
                             .set("cut", r.restarts.cut)
                             .set("armijo", r.restarts.armijo)
                             .set("prescribed", r.restarts.prescribed))
        .set("backtracks", r.backtracks)
        .set("cuts", r.cuts)
        .set("refreshes", r.refreshes)
        .set("linear_iterations", r.linear_iterations)
        .set("seconds", timer.seconds());
    if (scene_.output.check) {
      auto const inverted = inverted_tets(geometry_.mesh, simulation_->positions()).size();
      inverted_ = std::max(inverted_, inverted);
      line.set("inverted", inverted);
    }
    log_->write(line);
    worst_error_ = std::max(worst_error_, r.error_estimate_m);
    note_ = fmt::format("{} its, error {:.1e} m{}", r.iterations, r.error_estimate_m,
                        r.converged() ? "" : fmt::format(", {}", to_string(r.stop)));
  }

  void write_frame() {
    auto const x = simulation_->positions();
    result_->append(simulation_->time(), x, simulation_->velocities());
    if (!scene_.output.obj) return;
    if (boundary_.empty()) boundary_ = boundary_faces(geometry_.mesh.tets);
    write_obj(folder_ / "obj" / fmt::format("frame_{:05}.obj", simulation_->steps()),
              {x, boundary_});
  }

  void checkpoint() {
    Checkpoint checkpoint;
    simulation_->save(checkpoint);
    checkpoint.set("frames_written",
                   std::vector<std::int32_t>{static_cast<std::int32_t>(result_->frames())});
    write_checkpoint(folder_ / "checkpoint.h5", checkpoint, text_);
  }

  void summarise(std::string const& how) {
    Record summary;
    summary.set("scene", scene_.name)
        .set("ended", how)
        .set("vertices", geometry_.mesh.points.size())
        .set("tets", geometry_.mesh.tets.size())
        .set("method", scene_.solver.text("method"))
        .set("preconditioner", scene_.solver.text("preconditioner"))
        .set("precision", scene_.solver.text("precision"))
        .set("frames", simulation_->steps())
        .set("frames_asked", scene_.frames)
        .set("steps_of_this_run", steps_)
        .set("steps_converged", converged_)
        .set("mean_iterations", steps_ > 0 ? double(iterations_) / steps_ : 0)
        .set("restarts", restarts_)
        .set("largest_error_estimate_m", worst_error_)
        .set("most_inverted_elements", inverted_)
        .set("seconds", seconds_)
        .set("frames_per_second", seconds_ > 0 ? steps_ / seconds_ : 0)
        .set("warnings", geometry_.warnings);
    write_summary(folder_ / "summary.json", summary);
  }

  void say_where(int first) const {
    fmt::print(
        "{} {}: frames {} to {} in {:.1f} s ({:.1f} per second), {:.1f} iterations each, {} of "
        "{} steps converged, largest error estimate {:.1e} m\n",
        scene_.name, interrupted ? "interrupted" : "done", first, simulation_->steps(), seconds_,
        seconds_ > 0 ? steps_ / seconds_ : 0, steps_ > 0 ? double(iterations_) / steps_ : 0,
        converged_, steps_, worst_error_);
    fmt::print("result   {}   (ParaView: open it, or {} before 5.12)\n", result_path().string(),
               "result.xdmf");
    fmt::print("pictures ./taut render {}\n", folder_.string());
    fmt::print("check    ./taut check {}\n", folder_.string());
    if (interrupted) fmt::print("go on    the same command with --restart\n");
  }

  Scene const& scene_;
  SceneGeometry const& geometry_;
  std::filesystem::path folder_;
  std::string text_;
  std::unique_ptr<Simulation> simulation_;
  std::optional<ResultWriter> result_;
  std::optional<JsonLines> log_;
  std::vector<Triangle> boundary_;
  std::string note_;
  int steps_ = 0, converged_ = 0;
  std::int64_t iterations_ = 0, restarts_ = 0;
  std::size_t inverted_ = 0;
  double seconds_ = 0, worst_error_ = 0;
};

}  // namespace

int run_command(RunOptions const& options) {
  Scene const scene = load_scene(find_scene(options.scene.scene), options.scene.changes);
  SceneGeometry const geometry = build_geometry(scene);
  require_memory(geometry, scene.solver);
  for (std::string const& warning : geometry.warnings) fmt::print(stderr, "warning: {}\n", warning);
  return Run(scene, geometry, options).run();
}

}  // namespace taut
