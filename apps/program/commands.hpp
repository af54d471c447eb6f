// The commands of the program, one function each; program.cpp maps the command line onto
// their options. All return the exit status and throw Error for what the user can mend.
#pragma once

#include <taut/apps/program/scene.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace taut {

/// Options that every command that reads a scene has.
struct SceneArguments {
  std::string scene = "eight_letters";  ///< a built-in name or a file
  SceneChanges changes;
};

/// Folders that are searched for scenes named without a path.
std::vector<std::filesystem::path> scene_folders();
/// The file of a scene that is named by its path or is built in. Throws Error naming the nearest.
std::filesystem::path find_scene(std::string const& name);

/// When a run looks for intersections. A scene that starts with some is refused if any later ones
/// are looked for, or if it has contact, and warned of if not.
enum class CheckRun { off, every_step, every_iteration };

struct RunOptions {
  SceneArguments scene;
  std::filesystem::path out;  ///< empty: results/NAME
  bool force = false;
  bool restart = false;
  CheckRun check = CheckRun::off;
};
int run_command(RunOptions const& options);

/// Every frame of a result: inverted elements, values that are not finite and, unless left out,
/// intersections and objects inside others. 0 if there are none.
int check_command(std::filesystem::path const& result, bool intersections = true);

/// The summaries of results that `run` wrote, a row each, in Markdown. Throws Error.
int table_command(std::vector<std::filesystem::path> const& results);

int scenes_command();
int methods_command();
int plan_command(SceneArguments const& scene);

/// The result file of a folder that `run` wrote, or the file itself. Throws Error.
std::filesystem::path result_file(std::filesystem::path const& result);

}  // namespace taut
