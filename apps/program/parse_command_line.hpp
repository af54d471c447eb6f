// How `taut` and `taut bench` take their words apart: what is unknown is answered with the nearest
// that is known.
#pragma once

#include <taut/apps/program/command_line.hpp>

#include <fmt/core.h>
#include <CLI/CLI.hpp>

#include <optional>
#include <string>
#include <vector>

namespace taut {

/// The names of the subcommands of `app`.
inline std::vector<std::string> commands_of(CLI::App const& app) {
  std::vector<std::string> names;
  for (auto const* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

/// The names of the options of `app`, each with its dashes.
inline std::vector<std::string> options_of(CLI::App const& app) {
  std::vector<std::string> names;
  for (auto const* option : app.get_options())
    for (std::string const& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

/// Parses the command line. An exit status, where nothing is left to be done: help was asked for,
/// or the words are not understood, which is said with the nearest word that would be.
inline std::optional<int> parse_command_line(CLI::App& app, int argc, char** argv) {
  std::string const program = app.get_name();
  if (auto const message = unknown_command(program, commands_of(app), argc, argv)) {
    fmt::print(stderr, "taut: {}\n", *message);
    return 1;
  }
  // CLI11 would miss the command first.
  if (std::string const word = argc > 1 ? argv[1] : "";
      word.starts_with('-') && !app.get_option_no_throw(word.substr(0, word.find('=')))) {
    fmt::print(stderr, "taut: {}\n", unexpected_words(program, options_of(app), {word}));
    return 1;
  }
  try {
    app.parse(argc, argv);
  } catch (CLI::ExtrasError const&) {
    auto const commands = app.get_subcommands();
    CLI::App const& command = commands.empty() ? app : *commands.front();
    fmt::print(stderr, "taut: {}\n",
               unexpected_words(commands.empty() ? program : program + " " + command.get_name(),
                                options_of(command), app.remaining(true)));
    return 1;
  } catch (CLI::ParseError const& error) {
    return app.exit(error);
  }
  return {};
}

}  // namespace taut
