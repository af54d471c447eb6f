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

/// Where the first argument is none of `commands`: a sentence that names the nearest, if any is.
std::optional<std::string> unknown_command(std::string const& program,
                                           std::vector<std::string> const& commands, int argc,
                                           char** argv);

/// Of the words that a command line has too many, never none: a sentence that names the first
/// option among them, and the nearest of `options`, or the first word.
std::string unexpected_words(std::string const& command, std::vector<std::string> const& options,
                             std::vector<std::string> const& words);

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
