// `taut run`: steps a scene and writes its result, report and checkpoints.
#include <taut/apps/program/choose_preconditioner.hpp>
#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/intersections.hpp>
#include <taut/apps/program/memory.hpp>
#include <taut/apps/program/methods.hpp>
#include <taut/apps/program/run_identity.hpp>
#include <taut/apps/program/scene_result.hpp>
#include <taut/apps/program/simulation.hpp>
#include <taut/core/io/checkpoint.hpp>
#include <taut/core/io/mesh_reader.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/progress.hpp>
#include <taut/core/report/report_log.hpp>
#include <taut/core/report/timer.hpp>

#include <fmt/core.h>

#include <algorithm>
#include <csignal>
#include <optional>
#include <span>

namespace taut {

namespace {

std::sig_atomic_t volatile interrupted = 0;
/// A second signal of the kind ends the process as it would have without us.
void interrupt(int signal) {
  interrupted = signal;
  std::signal(signal, SIG_DFL);
}

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

/// Sums over all steps of a run, the legs before its restarts included.
struct Totals {
  double seconds = 0;
  double steps = 0, converged = 0, iterations = 0, restarts = 0;
  double worst_error = 0;                  ///< m
  double most_inverted = 0;                ///< elements in one step
  double inverted_steps = 0;               ///< steps that end with inverted elements
  double cut_steps = 0;                    ///< steps in which a bound cut an iteration
  double contacts = 0, most_contacts = 0;  ///< at the ends of steps
  double smallest_gap = 1;                 ///< of these, over the distance of contact
  double work = 0;          ///< iterations, each times the share of unknowns it worked on
  double most_islands = 0;  ///< in one step

  std::vector<double> to_numbers() const {
    return {seconds,       steps,         converged,      iterations,  restarts,
            worst_error,   most_inverted, inverted_steps, cut_steps,   contacts,
            most_contacts, smallest_gap,  work,           most_islands};
  }
  static Totals from_numbers(std::vector<double> const& n) {
    if (n.size() != 14) throw Error("the checkpoint's totals are not fourteen numbers");
    return {n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7], n[8], n[9], n[10], n[11], n[12], n[13]};
  }
  double mean_iterations() const { return steps > 0 ? iterations / steps : 0; }
  double mean_work() const { return steps > 0 ? work / steps : 0; }
  double per_second() const { return seconds > 0 ? steps / seconds : 0; }
};

/// Removes what an earlier run left that this one does not overwrite at once.
void clear_folder(std::filesystem::path const& folder) {
  for (char const* name : {"checkpoint.h5", "summary.json", "report.jsonl"})
    std::filesystem::remove(folder / name);
  std::error_code none;
  for (auto const& entry : std::filesystem::directory_iterator(folder / "obj", none)) {
    std::string const name = entry.path().filename().string();
    if (name.starts_with("frame_") && name.ends_with(".obj")) std::filesystem::remove(entry.path());
  }
}

/// What starts intersecting stays so where there is contact. Where there is none, it may be meant
/// to: it is warned of, unless the run is to be free of intersections.
void check_start(Scene const& scene, SceneGeometry& geometry, std::span<Point const> start,
                 ObjectIntersections const& surface, RunOptions const& options) {
  auto const found = surface.find(start);
  if (found.empty()) return;
  std::string const what =
      fmt::format("{}: the scene starts with {}; the first: {}", scene.file.string(),
                  surface.count(found), surface.text(found.front()));
  if (scene.contact || (options.check != CheckRun::off && !options.restart)) {
    bool const obstacle = std::any_of(found.begin(), found.end(), [&](Intersection const& i) {
      return surface.with_obstacle(i);
    });
    throw Error("{}. Move the objects apart (object.NAME.translate{}){}", what,
                obstacle ? " or obstacle.NAME.translate" : "",
                scene.contact
                    ? ", or let one that meets itself start at rest"
                    : ", let one that meets itself start at rest, or run without --check");
  }
  geometry.warnings.push_back(what + ". Nothing keeps bodies apart: [contact] would");
}

class Run {
public:
  /// `surface`: where steps, or also iterations, are to be checked.
  Run(Scene const& scene, SceneGeometry const& geometry, RunOptions const& options,
      ObjectIntersections const* surface)
      : scene_(scene),
        geometry_(geometry),
        surface_(surface),
        check_(options.check),
        folder_(options.out.empty() ? std::filesystem::path("results") / scene.name : options.out),
        text_(run_identity(options.scene.changes, scene, geometry)),
        simulation_(Simulation::create(scene, geometry)) {
    if (options.restart) {
      go_on();
    } else {
      begin(options.force);
    }
  }

  int run() {
    int const first = simulation_->steps();
    double const seconds_before = totals_.seconds;
    ProgressLine progress(scene_.frames, "steps", first);
    Timer since_checkpoint;
    Signals const signals;
    try {
      while (simulation_->steps() < scene_.frames && !interrupted) {
        step();
        if (on_grid() || simulation_->steps() == scene_.frames) write_frame();
        recorded_ = simulation_->steps();
        if (since_checkpoint.seconds() > 10) {
          checkpoint();
          since_checkpoint.restart();
        }
        progress.update(simulation_->steps(), note_);
      }
      progress.finish();
      checkpoint();
      summarise(interrupted ? "interrupted" : "finished");
    } catch (std::exception const&) {
      progress.finish();
      // A step that is not wholly on disk is taken again from the checkpoint before it.
      if (recorded_ == simulation_->steps()) attempt([&] { checkpoint(); });
      attempt([&] { summarise("stopped by an error"); });
      throw;
    }
    say_where(first, totals_.seconds - seconds_before);
    return interrupted ? 128 + interrupted : 0;
  }

private:
  /// On the way out of an error, which must not be hidden by another one.
  template <class Action>
  static void attempt(Action&& action) {
    try {
      action();
    } catch (std::exception const& error) {
      fmt::print(stderr, "taut: {}\n", error.what());
    }
  }

  void begin(bool force) {
    if (std::filesystem::exists(result_path())) {
      if (!force) {
        throw Error(
            "{}: a result is there already: choose another --out, continue it with --restart or "
            "replace it with --force",
            folder_.string());
      }
      clear_folder(folder_);
    }
    result_.emplace(ResultWriter::create(
        result_path(), result_mesh(scene_, geometry_), capacity(),
        force ? ResultWriter::IfExists::replace : ResultWriter::IfExists::refuse));
    write_frame();
    log_.emplace(folder_ / "report.jsonl");
    checkpoint();
  }

  void go_on() {
    Checkpoint const checkpoint = read_checkpoint(folder_ / "checkpoint.h5", text_);
    simulation_->restore(checkpoint);
    recorded_ = simulation_->steps();
    totals_ = Totals::from_numbers(checkpoint.get<double>("totals"));
    std::int64_t written = checkpoint.number<std::int32_t>("frames_written");
    // The last state of a shorter run lies between the frames of a longer one.
    if (recorded_ < scene_.frames) {
      written = std::min(written, std::int64_t{recorded_ / scene_.output.every + 1});
    }
    result_.emplace(
        ResultWriter::resume(result_path(), result_mesh(scene_, geometry_), written, capacity()));
    // Line k of the report is step k, counted from 1.
    log_.emplace(folder_ / "report.jsonl", recorded_ + 1);
  }

  bool on_grid() const { return simulation_->steps() % scene_.output.every == 0; }

  std::filesystem::path result_path() const { return folder_ / "result.vtkhdf"; }
  /// Every so many steps, and the last one.
  std::int64_t capacity() const {
    return (scene_.frames + scene_.output.every - 1) / scene_.output.every + 1;
  }

  void step() {
    Checkpoint before;
    if (surface_) simulation_->save(before);
    Timer const timer;
    NewtonReport const r = simulation_->step(watch_iterations());
    double const seconds = timer.seconds();
    if (surface_) refuse_intersections(before);
    totals_.seconds += seconds;
    ++totals_.steps;
    totals_.iterations += r.iterations;
    totals_.work += r.active * r.iterations;
    totals_.most_islands = std::max(totals_.most_islands, double(r.islands));
    totals_.converged += r.converged();
    totals_.restarts += static_cast<double>(r.restarts.total());
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
        .set("islands", r.islands)
        .set("left", r.left)
        .set("woken", r.woken)
        .set("asleep", r.asleep)
        .set("active", r.active)
        .set("linear_iterations", r.linear_iterations)
        .set("seconds", seconds);
    totals_.cut_steps += r.cuts > 0;
    if (auto const contact = simulation_->contact()) {
      totals_.contacts += contact->contacts;
      totals_.most_contacts = std::max(totals_.most_contacts, double(contact->contacts));
      totals_.smallest_gap = std::min(totals_.smallest_gap, contact->smallest_gap);
      line.set("contacts", contact->contacts)
          .set("candidates", contact->candidates)
          .set("smallest_gap", contact->smallest_gap);
    }
    if (scene_.output.check) {
      auto const inverted = inverted_tets(geometry_.mesh, simulation_->positions()).size();
      totals_.most_inverted = std::max(totals_.most_inverted, static_cast<double>(inverted));
      totals_.inverted_steps += inverted > 0;
      line.set("inverted", inverted);
    }
    log_->write(line);
    totals_.worst_error = std::max(totals_.worst_error, r.error_estimate_m);
    note_ = fmt::format("{} its, error {:.1e} m{}", r.iterations, r.error_estimate_m,
                        r.converged() ? "" : fmt::format(", {}", to_string(r.stop)));
  }

  /// After a step that leaves intersections: goes back to the state before it, puts that into the
  /// result and throws.
  void refuse_intersections(Checkpoint const& before) {
    auto const found = surface_->find(simulation_->positions());
    if (found.empty()) return;
    int const step = simulation_->steps();
    double const time = simulation_->time();
    simulation_->restore(before);
    if (!on_grid()) write_frame();
    throw Error(
        "step {} at {:.6g} s leaves {}; the first: {}. The state before it is the last frame. {}: "
        "--restart without --check goes on",
        step, time, surface_->count(found), surface_->text(found.front()), who_is_to_blame());
  }
  std::string who_is_to_blame() const {
    if (!scene_.contact) return "Nothing keeps bodies apart, add a table [contact]";
    if (scene_.contact->text("bound") == "half_dhat") {
      return "contact.bound = \"half_dhat\" is no guarantee, use additive_ccd";
    }
    return "That must not happen with contact, report it together with the scene";
  }
  IterationObserver watch_iterations() const {
    if (check_ != CheckRun::every_iteration) return {};
    return [&](IterationView const& view) {
      auto const found = surface_->find(view.positions());
      if (found.empty()) return;
      throw Error("step {} at {:.6g} s: iteration {} leaves {}; the first: {}. {}",
                  simulation_->steps() + 1, simulation_->time(), view.index + 1,
                  surface_->count(found), surface_->text(found.front()), who_is_to_blame());
    };
  }

  void write_frame() {
    auto const x = simulation_->positions();
    result_->append(simulation_->time(), x, simulation_->velocities());
    if (!scene_.output.obj) return;
    if (boundary_.empty()) boundary_ = boundary_faces(geometry_.mesh.tets);
    // Bodies alone: the points of obstacles are behind theirs.
    write_obj(folder_ / "obj" / fmt::format("frame_{:05}.obj", simulation_->steps()),
              {{x.begin(), x.begin() + std::ssize(geometry_.mesh.points)}, boundary_});
  }

  void checkpoint() {
    Checkpoint checkpoint;
    simulation_->save(checkpoint);
    checkpoint.set("frames_written",
                   std::vector<std::int32_t>{static_cast<std::int32_t>(result_->frames())});
    checkpoint.set("totals", totals_.to_numbers());
    write_checkpoint(folder_ / "checkpoint.h5", checkpoint, text_);
  }

  void summarise(std::string const& how) {
    Record summary;
    if (scene_.contact) set_contact(summary);
    PreconditionerChoice const preconditioner = choose_preconditioner(scene_, geometry_);
    summary.set("scene", scene_.name)
        .set("ended", how)
        .set("vertices", geometry_.mesh.points.size())
        .set("tets", geometry_.mesh.tets.size())
        .set("method", scene_.solver.text("method"))
        .set("preconditioner", preconditioner.name)
        .set("preconditioner_because", preconditioner.reason)
        .set("precision", scene_.solver.text("precision"))
        .set("frames", simulation_->steps())
        .set("frames_asked", scene_.frames)
        .set("steps_converged", static_cast<std::int64_t>(totals_.converged))
        .set("mean_iterations", totals_.mean_iterations())
        .set("mean_work", totals_.mean_work())
        .set("most_islands", static_cast<std::int64_t>(totals_.most_islands))
        .set("restarts", static_cast<std::int64_t>(totals_.restarts))
        .set("largest_error_estimate_m", totals_.worst_error)
        .set("most_inverted_elements", static_cast<std::int64_t>(totals_.most_inverted))
        .set("steps_with_inverted_elements", static_cast<std::int64_t>(totals_.inverted_steps))
        .set("intersections", std::string(check_ == CheckRun::off ? "not looked for" : "none"))
        .set("seconds", totals_.seconds)
        .set("frames_per_second", totals_.per_second())
        .set("warnings", geometry_.warnings);
    write_summary(folder_ / "summary.json", summary);
  }

  void set_contact(Record& summary) const {
    summary.set("mean_contacts", totals_.steps > 0 ? totals_.contacts / totals_.steps : 0)
        .set("most_contacts", static_cast<std::int64_t>(totals_.most_contacts))
        .set("smallest_gap", totals_.smallest_gap)
        .set("steps_cut", static_cast<std::int64_t>(totals_.cut_steps));
  }

  void say_where(int first, double seconds) const {
    int const steps = simulation_->steps() - first;
    if (steps == 0) {
      fmt::print("{}: nothing to do, all {} steps are there; --frames asks for more\n", scene_.name,
                 first);
    } else {
      fmt::print(
          "{} {}: steps {} to {} in {:.1f} s ({:.1f} per second); {:.1f} iterations each, {:.0f} "
          "of {:.0f} steps converged, largest error estimate {:.1e} m\n",
          scene_.name, interrupted ? "interrupted" : "done", first + 1, simulation_->steps(),
          seconds, seconds > 0 ? steps / seconds : 0, totals_.mean_iterations(), totals_.converged,
          totals_.steps, totals_.worst_error);
    }
    if (scene_.contact) {
      fmt::print(
          "contact  {:.1f} pairs on average, {:.0f} at most; smallest gap {:.2g} of dhat{}\n",
          totals_.steps > 0 ? totals_.contacts / totals_.steps : 0, totals_.most_contacts,
          totals_.smallest_gap, surface_ ? "; no intersections" : "");
    }
    if (totals_.inverted_steps > 0) {
      fmt::print(
          "inverted elements in {:.0f} of {:.0f} steps, at most {:.0f} of {} at a time: this "
          "material tolerates them; neo_hookean does not let them be\n",
          totals_.inverted_steps, totals_.steps, totals_.most_inverted, geometry_.mesh.tets.size());
    }
    fmt::print("result   {}   (ParaView: open it, or {} before 5.12)\n", result_path().string(),
               "result.xdmf");
    fmt::print("pictures ./taut render {}\n", folder_.string());
    fmt::print("check    ./taut check {}\n", folder_.string());
    if (interrupted) fmt::print("go on    the same command with --restart\n");
  }

  Scene const& scene_;
  SceneGeometry const& geometry_;
  ObjectIntersections const* surface_;  ///< null: not asked for
  CheckRun check_;
  std::filesystem::path folder_;
  std::string text_;
  std::unique_ptr<Simulation> simulation_;
  std::optional<ResultWriter> result_;
  std::optional<JsonLines> log_;
  std::vector<Triangle> boundary_;
  std::string note_;
  Totals totals_;
  int recorded_ = 0;  ///< steps whose line and frame are written
};

}  // namespace

int run_command(RunOptions const& options) {
  Scene const scene = load_scene(find_scene(options.scene.scene), options.scene.changes);
  SceneGeometry geometry = build_within_memory(scene);
  ResultMesh const start = result_mesh(scene, geometry);
  ObjectIntersections const surface(start);
  check_start(scene, geometry, start.mesh.points, surface, options);
  for (std::string const& warning : geometry.warnings) fmt::print(stderr, "warning: {}\n", warning);
  return Run(scene, geometry, options, options.check == CheckRun::off ? nullptr : &surface).run();
}

}  // namespace taut
