// `taut chart`: what accuracy a method reaches, after how many iterations and seconds. All methods
// start from the same state, that before one time step of a scene, and are measured against an
// over-solved solution of that step: never against their own residuals, which mean something else
// for every method, preconditioner and stiffness.
//
// With `sweep`, the iterations and seconds to an error of `target` against the swept value of the
// scene. With `totals`, the seconds of whole scenes. With `stability`, no errors: how far policies
// of contact bring the scene until a step is not clean. With `matrices`, no methods either: how
// full the matrices of hierarchies are, level by level.
//
// Where terms know a characteristic force (material points) all is measured a second time, by the
// residual that the literature stops by, and drawn as residual.png.
#pragma once

#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/late_part.hpp>

#include <optional>

namespace taut {

struct ChartOptions {
  SceneArguments scene;
  /// NAME[:KEY=VALUE...] with the keys of [solver], as in "dk:preconditioner=jacobi"; empty or
  /// "all": every method with the scene's own options.
  std::vector<std::string> methods;
  std::vector<int>
      frames;  ///< time steps to compare, counted from 1; empty: the tenth, or the last
  std::vector<std::string> with;  ///< other scenes in the same chart; overrides hold for all
  bool without_contact = false;   ///< also the same steps, from the same states, without contact
  bool sweep = false;
  bool stability = false;
  bool totals = false;  ///< whole scenes instead of single steps
  bool matrices = false;
  int levels = 5;           ///< of `matrices`, the fine one counted
  std::string relative;     ///< method of `totals` whose seconds are the unit
  bool linear = false;      ///< also counts linear iterations up to each of a comparison
  std::vector<int> fields;  ///< iterations of a comparison that are shown point by point
  /// Of `stability`: KEY=VALUE[:KEY=VALUE...] of [contact], or of another table as TABLE.KEY; empty
  /// or "all": those of `default_policies`.
  std::vector<std::string> policies;
  double target = 0.01;          ///< a method that ends above this error has failed
  double lowest = 1e-8;          ///< below this error a curve ends
  double residual = 1e-7;        ///< that counts as solved, where there are residuals
  std::optional<double> length;  ///< m, what errors are relative to; by default the step's motion
  int max_iterations = 2000;
  double max_seconds = 60;    ///< per method, while its errors are recorded; or per policy
  int repetitions = 3;        ///< of the runs that are timed
  std::filesystem::path out;  ///< empty: charts/NAME
  bool force = false;         ///< replaces a chart that is there
  bool draw = true;           ///< false: no pictures, no Python
};

/// Writes data.csv, data.json, chart.svg and chart.png; with `totals` also frames.csv, a row per
/// frame, with `fields` fields.csv, a row per point, with `matrices` patterns.csv, and what is
/// drawn of these. Throws Error.
int chart_command(ChartOptions const& options);
inline constinit LatePart<int(ChartOptions const&)> chart_command_late;

}  // namespace taut
