#include <taut/apps/program/commands.hpp>
#include <taut/apps/program/render_python.hpp>
#include <taut/core/io/file.hpp>
#include <taut/core/report/error.hpp>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>

#include <cstdlib>

extern char** environ;

namespace taut {
namespace {

namespace fs = std::filesystem;

fs::path environment_folder() {
  if (char const* own = std::getenv("TAUT_PYTHON_ENV")) return own;
  if (char const* cache = std::getenv("XDG_CACHE_HOME")) return fs::path(cache) / "taut/python";
  if (char const* home = std::getenv("HOME")) return fs::path(home) / ".cache/taut/python";
  throw Error("TAUT_PYTHON_ENV, XDG_CACHE_HOME and HOME are all unset: set one to a folder");
}

/// The scripts lie beside the scenes.
fs::path find_script(std::string const& name) {
  for (fs::path const& scenes : scene_folders()) {
    fs::path const script = scenes.parent_path() / "python" / name;
    if (fs::is_regular_file(script)) return script;
  }
  throw Error("{}: the drawing script lies in no folder python beside the scenes; install it there",
              name);
}

/// Runs a program to its end; true if it ended with status 0. Its output goes to the file `log`, or
/// with an empty `log` to ours.
bool run(std::vector<std::string> const& command, fs::path const& log = {}) {
  std::vector<char*> arguments;
  for (std::string const& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (!log.empty()) {
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(),
                                     O_WRONLY | O_CREAT | O_APPEND, 0644);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  }
  pid_t child = 0;
  int const error =
      posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  return error == 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) &&
         WEXITSTATUS(status) == 0;
}

std::string joined(std::vector<std::string> const& words) {
  std::string text;
  for (std::string const& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

bool has_modules(fs::path const& python, std::vector<std::string> const& modules,
                 fs::path const& log) {
  std::string const find =
      "import sys, importlib.util as u; sys.exit(any(u.find_spec(m) is None for m in "
      "sys.argv[1:]))";
  std::vector<std::string> command{python.string(), "-c", find};
  command.insert(command.end(), modules.begin(), modules.end());
  return fs::exists(python) && run(command, log);
}

}  // namespace

void run_drawing(DrawingScript const& script, std::vector<std::string> const& arguments,
                 fs::path const& input) {
  fs::path const file = find_script(script.name);
  fs::path const folder = environment_folder(), python = folder / "bin/python3";
  fs::path const log = folder.string() + ".log";
  make_parent_folder(log);
  std::error_code none;
  fs::remove(log, none);
  if (!has_modules(python, script.modules, log)) {
    fmt::print(stderr, "taut: fetching {} into {}, once\n", joined(script.packages),
               folder.string());
    std::vector<std::string> pip{python.string(), "-m", "pip", "install", "--quiet"};
    pip.insert(pip.end(), script.packages.begin(), script.packages.end());
    bool const made = run({"python3", "-m", "venv", folder.string()}, log) && run(pip, log);
    if (!made || !has_modules(python, script.modules, log)) {
      throw Error(
          "{} is not drawn: Python's {} could not be put into {} (what went wrong is in {}); set "
          "TAUT_PYTHON_ENV to a virtual environment that has it",
          input.string(), joined(script.packages), folder.string(), log.string());
    }
  }
  std::vector<std::string> command{python.string(), file.string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  if (!run(command)) {
    throw Error("{} is not drawn: {} failed with the message above", input.string(), script.name);
  }
}

}  // namespace taut
