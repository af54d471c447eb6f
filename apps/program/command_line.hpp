// What the command lines of `taut` and `taut bench` share. It does not include CLI11, whose header
// takes longer to compile than all of this.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace taut {

/// Adds a list with commas to `command`, a CLI::App; a word after it is the next argument.
template <class App, class T>
auto* add_list(App& command, std::string const& option, std::vector<T>& list,
               std::string const& help) {
  return command.add_option(option, list, help)->delimiter(',')->allow_extra_args(false);
}

/// The names of the subcommands of `app`, a CLI::App.
template <class App>
std::vector<std::string> commands_of(App const& app) {
  std::vector<std::string> names;
  for (auto const* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

/// Where the first argument is none of `commands`: a sentence that names the nearest, if any is.
std::optional<std::string> unknown_command(std::string const& program,
                                           std::vector<std::string> const& commands, int argc,
                                           char** argv);

/// The program `taut`, from its command line to its exit status.
int run_program(int argc, char** argv);

/// Becomes the program of this name, which stands beside the present one, for the sake of `what`.
/// If the environment holds TAUT_BUILD, a command that takes the name of a target, that is called
/// first. Returns, with an exit status, only where that program cannot be had.
int hand_over(std::string const& program, char** argv, std::string const& what);

/// The exit status of `command`. What it throws becomes a sentence for the user, and 1; but
/// LeftToTheWhole is the caller's.
int ending_in_words(std::function<int()> const& command);

}  // namespace taut
