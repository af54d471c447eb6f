// What runs of all kinds of scenes have in common: steps until there are enough or a signal comes,
// and a result, a report, a summary and checkpoints in an order that a kill at any moment survives.
#pragma once

#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/run_identity.hpp>
#include <taut/apps/program/simulation.hpp>
#include <taut/core/io/vtkhdf.hpp>
#include <taut/core/report/report_log.hpp>

#include <optional>

namespace taut {

/// Sums over all steps of a run, the legs before its restarts included. What a scene does not have
/// stays as it is here.
struct RunTotals {
  double seconds = 0;
  double steps = 0, converged = 0, iterations = 0, restarts = 0;
  double worst_error = 0;                  ///< m
  double most_inverted = 0;                ///< elements or particles in one step
  double inverted_steps = 0;               ///< steps that end with any
  double cut_steps = 0;                    ///< steps in which a bound cut an iteration
  double contacts = 0, most_contacts = 0;  ///< at the ends of steps
  double smallest_gap = 1;                 ///< of these, over the distance of contact
  double work = 0;          ///< iterations, each times the share of unknowns it worked on
  double most_islands = 0;  ///< in one step
  double grid_steps = 0, halvings = 0;  ///< of material points
  double most_nodes = 0;                ///< of their grid
  double checked_steps = 0;             ///< looked at for intersections, those taken back included
  double intersecting_steps = 0;        ///< of these, with any

  std::vector<double> to_numbers() const;
  /// Throws Error if these are not as many.
  static RunTotals from_numbers(std::vector<double> const& numbers);
  double mean_iterations() const { return steps > 0 ? iterations / steps : 0; }
  double mean_work() const { return steps > 0 ? work / steps : 0; }
  double per_second() const { return seconds > 0 ? steps / seconds : 0; }
};

class RunLoop {
public:
  virtual ~RunLoop() = default;
  RunLoop(RunLoop const&) = delete;
  RunLoop& operator=(RunLoop const&) = delete;

  /// Begins or goes on, to the end. Returns the exit status; throws Error.
  int run();

protected:
  RunLoop(Scene const& scene, RunOptions const& options, ResultMesh start, RunIdentity identity);

  virtual Simulation& simulation() = 0;
  Simulation const& simulation() const { return const_cast<RunLoop*>(this)->simulation(); }
  /// One step, and what comes before and behind it without counting as time of the solver.
  virtual void before_step() {}
  virtual NewtonReport step() = 0;
  virtual void accept_step() {}
  /// What else the report has of the step that was just taken; adds to totals(), too.
  virtual void add_to_line(Record& line) = 0;
  virtual void append_frame(ResultWriter& result) = 0;
  virtual void add_to_summary(Record& summary) const = 0;
  /// What else is said at the end.
  virtual void say_more() const = 0;

  RunTotals& totals() { return totals_; }
  RunTotals const& totals() const { return totals_; }
  std::filesystem::path const& folder() const { return folder_; }
  /// Writes the state as a frame if the last step did not, or if it is from within a step: before
  /// an error leaves the run.
  void write_frame_off_grid(bool within_step = false);

private:
  void begin();
  void go_on();
  bool on_grid() const { return simulation().steps() % scene_.output.every == 0; }
  std::filesystem::path result_path() const;
  std::int64_t capacity() const;
  void take_step();
  void checkpoint();
  void summarise(std::string const& how) const;
  void say_where(int first, double seconds) const;

  Scene const& scene_;
  ResultMesh start_;
  RunIdentity identity_;
  std::vector<std::string> changes_;  ///< of the solver, by restarts
  std::filesystem::path folder_;
  bool force_, restart_;
  std::optional<ResultWriter> result_;
  std::optional<JsonLines> log_;
  std::string note_;
  RunTotals totals_;
  int recorded_ = 0;  ///< steps whose line and frame are written
};

/// The run of a scene of material points.
int run_particles(Scene const& scene, RunOptions const& options);

}  // namespace taut
