// The data behind a chart: lines "# name = value" that say what was measured, then comma-separated
// rows under a line of column names.
#pragma once

#include <taut/apps/chart/chart.hpp>
#include <taut/apps/chart/method.hpp>
#include <taut/apps/program/scene_geometry.hpp>

#include <map>
#include <string>
#include <vector>

namespace taut {

/// Tables besides data.csv, by the names of their files.
using MoreTables = std::map<std::string, std::string>;

/// A method with the scene that runs it, which is also what checks its options.
struct Contestant {
  std::string label;
  Scene scene;
};

/// The scene with `changes` once per method: stopping rules out of the way, the method's options on
/// top. Throws Error.
std::vector<Contestant> contestants(std::filesystem::path const& scene, SceneChanges const& changes,
                                    std::vector<ChartMethod> const& methods, int max_iterations);

/// What every chart says about its scene and machine; `size`: lines about its discretisation.
std::string describe(Scene const& scene, std::string const& size,
                     std::vector<MaterialParameters> const& materials);
std::string describe(Scene const& scene, SceneGeometry const& geometry);

/// The error that counts as solved, what errors of position are relative to, and of material points
/// the residual that does.
std::string describe_target(ChartOptions const& options, bool particles);

/// A number as a field of a row: empty if it is not one.
std::string field(double number);
/// A text as a field of a row: in quotes where it would not be one field as it is.
std::string field(std::string const& text);

/// scene,frame,method,iteration,seconds,position_error,energy_gap,residual,linear_iterations,ended:
/// a row per iteration; the last row of a method says how it ended (see Trace). Energies are empty
/// where there is contact, residuals where there are none, linear iterations (up to this one) where
/// they were not asked for. fields.csv, of the iterations that were, has a row per point, which is
/// where it is at the start of the step: scene,frame,method,iteration,x,y,z,error,residual.
std::string compare_methods(std::filesystem::path const& scene, ChartOptions const& options,
                            std::vector<ChartMethod> const& methods, MoreTables& more);

/// value,method,iterations,seconds,position_error,residual_iterations,residual_seconds,residual,
/// ended: a row per method and swept value, with what it took to bring the error to `target`, and
/// the residual to its own; iterations and seconds are empty where that failed.
std::string sweep_methods(std::filesystem::path const& scene, ChartOptions const& options,
                          std::vector<ChartMethod> const& methods);

/// scene,method,frames,of_frames,seconds,iterations,linear_iterations,converged_frames,grid_steps,
/// error_m,ended: a row per scene and method, with the whole scene, by the rule that ends its
/// steps. `error_m` is the largest distance, at the end, from the scene by its own method with a
/// thousandth of its tolerance, empty where that has not converged in every frame. `ended`: "end of
/// scene", "not converged" (some frames), "out of time" or "no step" (an error). frames.csv:
/// scene,method,frame,seconds,iterations,linear_iterations,grid_steps.
std::string totals_of_methods(std::filesystem::path const& scene, ChartOptions const& options,
                              std::vector<ChartMethod> const& methods, MoreTables& more);

/// hierarchy,level,nodes,nonzeros,per_row: a row per level of the Galerkin hierarchy P'AP and of
/// levels made of the particles, above the matrix of the nodes of a frame's first step; numbers of
/// scalars that may be other than zero, by the patterns alone, boundaries left out. patterns.csv:
/// hierarchy,level,bins,row,column,blocks, where nodes in the order of their coordinates are
/// gathered in so many bins and only those with blocks have a row.
std::string patterns_of_matrices(std::filesystem::path const& scene, ChartOptions const& options,
                                 MoreTables& more);

/// policy,steps,seconds_simulated,turns,inverted_seconds,inverted_turns,iterations,most_contacts,
/// smallest_gap,seconds,ended,why: a row per policy, up to the last step that was clean: without an
/// intersection, by the exact test, without an inverted element of a material that forbids it, and
/// converged. `ended` says what came then: "intersects", "inverts", "not converged", "no step" (an
/// error), "out of time" or "end of scene". Elements of other materials are inverted for the first
/// time at `inverted_...`, empty if never. Turns are those of the pin that turns most.
std::string stability_of_policies(std::filesystem::path const& scene, ChartOptions const& options);

/// The fields of a row, without the quotes of `field`.
std::vector<std::string> split_row(std::string const& line);

/// The same as JSON: `facts`, `rows` with null for what is empty and, of a comparison, what every
/// method took to stay below the target: iterations, seconds, frames per second (in `methods`), and
/// to be stopped by its residual, where there is one.
std::string to_json(std::string const& table);

}  // namespace taut
