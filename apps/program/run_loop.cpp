#include <taut/apps/program/run_loop.hpp>
#include <taut/core/io/checkpoint.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/progress.hpp>
#include <taut/core/report/timer.hpp>

#include <fmt/core.h>

#include <unistd.h>

#include <algorithm>
#include <csignal>

namespace taut {
namespace {

std::sig_atomic_t volatile interrupted = 0;
/// A second signal of the kind ends the process as it would have without us.
void interrupt(int signal) {
  interrupted = signal;
  std::signal(signal, SIG_DFL);
  static constexpr char words[] = "\ntaut: ends after this step; at once if asked again\n";
  [[maybe_unused]] auto const written = write(STDERR_FILENO, words, sizeof words - 1);
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

constexpr char const* result_name = "result.vtkhdf";

/// What an earlier run left, of the names that this one writes; the result first.
std::vector<std::filesystem::path> left_by_a_run(std::filesystem::path const& folder) {
  std::vector<std::filesystem::path> files;
  for (char const* name :
       {result_name, "result.xdmf", "checkpoint.h5", "summary.json", "report.jsonl"}) {
    if (std::filesystem::exists(folder / name)) files.push_back(folder / name);
  }
  std::error_code none;
  for (std::string const kind : {"obj", "vdb"}) {
    for (auto const& entry : std::filesystem::directory_iterator(folder / kind, none)) {
      std::string const name = entry.path().filename().string();
      if (entry.is_regular_file(none) && name.starts_with("frame_") && name.ends_with("." + kind)) {
        files.push_back(entry.path());
      }
    }
  }
  return files;
}

/// In a checkpoint, of the changes of the solver.
std::string change_name(std::size_t k) { return fmt::format("change {}", k); }

/// On the way out of an error, which must not be hidden by another one.
template <class Action>
void attempt(Action&& action) {
  try {
    action();
  } catch (std::exception const& error) {
    fmt::print(stderr, "taut: {}\n", error.what());
  }
}

}  // namespace

std::vector<double> RunTotals::to_numbers() const {
  return {seconds,       steps,         converged,      iterations,        restarts,
          worst_error,   most_inverted, inverted_steps, cut_steps,         contacts,
          most_contacts, smallest_gap,  work,           most_islands,      grid_steps,
          halvings,      most_nodes,    checked_steps,  intersecting_steps};
}

RunTotals RunTotals::from_numbers(std::vector<double> const& n) {
  if (n.size() != RunTotals().to_numbers().size()) {
    throw Error("the checkpoint has {} totals, {} are needed: start the run again", n.size(),
                RunTotals().to_numbers().size());
  }
  return {n[0],  n[1],  n[2],  n[3],  n[4],  n[5],  n[6],  n[7],  n[8], n[9],
          n[10], n[11], n[12], n[13], n[14], n[15], n[16], n[17], n[18]};
}

RunLoop::RunLoop(Scene const& scene, RunOptions const& options, ResultMesh start,
                 RunIdentity identity)
    : scene_(scene),
      start_(std::move(start)),
      identity_(std::move(identity)),
      folder_(options.out.empty() ? std::filesystem::path("results") / scene.name : options.out),
      force_(options.force),
      restart_(options.restart) {}

int RunLoop::run() {
  if (restart_) {
    go_on();
  } else {
    begin();
  }
  int const first = simulation().steps();
  double const seconds_before = totals_.seconds;
  ProgressLine progress(scene_.frames, "steps", first);
  Timer since_checkpoint;
  Signals const signals;
  try {
    while (simulation().steps() < scene_.frames && !interrupted) {
      take_step();
      if (on_grid() || simulation().steps() == scene_.frames) append_frame(*result_);
      recorded_ = simulation().steps();
      if (since_checkpoint.seconds() > 10) {
        checkpoint();
        since_checkpoint.restart();
      }
      progress.update(simulation().steps(), note_);
    }
    progress.finish();
    checkpoint();
    summarise(interrupted ? "interrupted" : "finished");
  } catch (std::exception const&) {
    progress.finish();
    // A step that is not wholly on disk is taken again from the checkpoint before it.
    if (recorded_ == simulation().steps()) attempt([&] { checkpoint(); });
    attempt([&] { summarise("stopped by an error"); });
    throw;
  }
  say_where(first, totals_.seconds - seconds_before);
  return interrupted ? 128 + interrupted : 0;
}

void RunLoop::begin() {
  for (std::filesystem::path const& file : left_by_a_run(folder_)) {
    bool const is_result = file == result_path();
    if (!force_) {
      throw Error(
          "{}: {} is there already: choose another --out{} or replace it with --force",
          folder_.string(),
          is_result ? "a result" : file.lexically_relative(folder_).string() + " of another run",
          is_result ? ", continue it with --restart" : "");
    }
    if (!is_result) std::filesystem::remove(file);  // the result is replaced in one step
  }
  result_.emplace(ResultWriter::create(
      result_path(), start_, capacity(),
      force_ ? ResultWriter::IfExists::replace : ResultWriter::IfExists::refuse));
  append_frame(*result_);
  log_.emplace(folder_ / "report.jsonl");
  checkpoint();
}

void RunLoop::go_on() {
  std::filesystem::path const path = folder_ / "checkpoint.h5";
  Checkpoint const checkpoint = read_checkpoint(path);
  std::vector<std::string> const now = solver_changes(identity_, checkpoint, path);
  simulation().restore(checkpoint);
  recorded_ = simulation().steps();
  totals_ = RunTotals::from_numbers(checkpoint.get<double>("totals"));
  std::int64_t written = checkpoint.number<std::int32_t>("frames_written");
  // The last state of a shorter run lies between the frames of a longer one.
  if (recorded_ < scene_.frames) {
    written = std::min(written, std::int64_t{recorded_ / scene_.output.every + 1});
  }
  result_.emplace(ResultWriter::resume(result_path(), start_, written, capacity()));
  for (std::size_t k = 0; checkpoint.texts.contains(change_name(k)); ++k) {
    changes_.push_back(checkpoint.texts.at(change_name(k)));
  }
  for (std::string const& change : now) {
    changes_.push_back(fmt::format("from step {} on: {}", recorded_ + 1, change));
    fmt::print("{}\n", changes_.back());
  }
  // Line k of the report is step k, counted from 1.
  log_.emplace(folder_ / "report.jsonl", recorded_ + 1);
}

std::filesystem::path RunLoop::result_path() const { return folder_ / result_name; }

std::int64_t RunLoop::capacity() const {  // every so many steps, and the last one
  return (scene_.frames + scene_.output.every - 1) / scene_.output.every + 1;
}

void RunLoop::write_frame_off_grid(bool within_step) {
  if (within_step || !on_grid()) append_frame(*result_);
}

void RunLoop::take_step() {
  before_step();
  Timer const timer;
  NewtonReport const r = step();
  double const seconds = timer.seconds();
  accept_step();
  totals_.seconds += seconds;
  ++totals_.steps;
  totals_.iterations += r.iterations;
  totals_.work += r.active * r.iterations;
  totals_.most_islands = std::max(totals_.most_islands, double(r.islands));
  totals_.converged += r.converged();
  totals_.restarts += static_cast<double>(r.restarts.total());
  Record line;
  line.set("frame", simulation().steps())
      .set("time", simulation().time())
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
      .set("extended", r.extended)
      .set("cuts", r.cuts)
      .set("refreshes", r.refreshes)
      .set("strengthened", r.strengthened)
      .set("islands", r.islands)
      .set("left", r.left)
      .set("woken", r.woken)
      .set("asleep", r.asleep)
      .set("active", r.active)
      .set("linear_iterations", r.linear_iterations)
      .set("seconds", seconds);
  totals_.cut_steps += r.cuts > 0;
  add_to_line(line);
  log_->write(line);
  totals_.worst_error = std::max(totals_.worst_error, r.error_estimate_m);
  note_ = fmt::format("{} its, error {:.1e} m{}", r.iterations, r.error_estimate_m,
                      r.converged() ? "" : fmt::format(", {}", to_string(r.stop)));
}

void RunLoop::checkpoint() {
  Checkpoint checkpoint;
  simulation().save(checkpoint);
  // A restart needs the frames that the checkpoint counts: it waits for the disk, and so do they.
  result_->sync();
  checkpoint.set("frames_written",
                 std::vector<std::int32_t>{static_cast<std::int32_t>(result_->frames())});
  checkpoint.set("totals", totals_.to_numbers());
  save(identity_, checkpoint);
  for (std::size_t k = 0; k < changes_.size(); ++k) checkpoint.texts[change_name(k)] = changes_[k];
  write_checkpoint(folder_ / "checkpoint.h5", checkpoint);
}

void RunLoop::summarise(std::string const& how) const {
  Record summary;
  add_to_summary(summary);
  summary.set("scene", scene_.name)
      .set("ended", how)
      .set("method", scene_.solver.text("method"))
      .set("precision", scene_.solver.text("precision"))
      .set("frames", simulation().steps())
      .set("frames_asked", scene_.frames)
      .set("steps_converged", static_cast<std::int64_t>(totals_.converged))
      .set("mean_iterations", totals_.mean_iterations())
      .set("mean_work", totals_.mean_work())
      .set("most_islands", static_cast<std::int64_t>(totals_.most_islands))
      .set("restarts", static_cast<std::int64_t>(totals_.restarts))
      .set("largest_error_estimate_m", totals_.worst_error)
      .set("seconds", totals_.seconds)
      .set("frames_per_second", totals_.per_second());
  if (!changes_.empty()) summary.set("solver_changes", changes_);
  write_summary(folder_ / "summary.json", summary);
}

void RunLoop::say_where(int first, double seconds) const {
  int const steps = simulation().steps() - first;
  if (steps == 0) {
    fmt::print("{}: nothing to do, all {} steps are there; --frames asks for more\n", scene_.name,
               first);
  } else {
    fmt::print(
        "{} {}: steps {} to {} in {:.1f} s ({:.1f} per second); {:.1f} iterations each, {:.0f} "
        "of {:.0f} steps converged, largest error estimate {:.1e} m\n",
        scene_.name, interrupted ? "interrupted" : "done", first + 1, simulation().steps(), seconds,
        seconds > 0 ? steps / seconds : 0, totals_.mean_iterations(), totals_.converged,
        totals_.steps, totals_.worst_error);
  }
  say_more();
  fmt::print("result   {}   (ParaView: open it, or {} before 5.12)\n", result_path().string(),
             "result.xdmf");
  fmt::print("pictures ./taut render {}\n", folder_.string());
  fmt::print("check    ./taut check {}\n", folder_.string());
  if (interrupted) fmt::print("go on    the same command with --restart\n");
}

}  // namespace taut
