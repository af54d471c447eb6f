#include <taut/apps/program/command_line.hpp>
#include <taut/apps/program/scene_value.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>

#include <algorithm>
#include <new>

namespace taut {

std::optional<std::string> unknown_command(std::string const& program,
                                           std::vector<std::string> const& commands, int argc,
                                           char** argv) {
  if (argc < 2 || argv[1][0] == '-') return {};
  if (std::find(commands.begin(), commands.end(), argv[1]) != commands.end()) return {};
  std::vector<std::string_view> const views(commands.begin(), commands.end());
  return fmt::format("there is no command \"{}\"{}; `{} --help` lists them", argv[1],
                     suggestion(": did you mean \"", argv[1], views, "\"?"), program);
}

int ending_in_words(std::function<int()> const& command) {
  try {
    return command();
  } catch (Error const& error) {
    fmt::print(stderr, "taut: {}\n", error.what());
  } catch (std::bad_alloc const&) {
    fmt::print(stderr, "taut: out of memory: lower the resolution\n");
  } catch (std::exception const& error) {
    fmt::print(stderr, "taut: {}\n", error.what());
  }
  return 1;
}

}  // namespace taut
