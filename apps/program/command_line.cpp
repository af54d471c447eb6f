#include <taut/apps/program/command_line.hpp>
#include <taut/apps/program/late_part.hpp>
#include <taut/apps/program/scene_value.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>

#ifdef _OPENMP
#include <omp.h>
#include <sched.h>
#endif
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <string_view>
#include <vector>

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

std::string unexpected_words(std::string const& command, std::vector<std::string> const& options,
                             std::vector<std::string> const& words) {
  auto const option = std::find_if(words.begin(), words.end(),
                                   [](std::string const& word) { return word.starts_with('-'); });
  if (option == words.end())
    return fmt::format("\"{}\" is a word too many for `{}`; `{} --help` lists what it takes",
                       words.front(), command, command);
  std::string const name = option->substr(0, option->find('='));
  std::vector<std::string_view> const views(options.begin(), options.end());
  return fmt::format("`{}` has no option {}{}; `{} --help` lists them", command, name,
                     suggestion(": did you mean ", name, views, "?"), command);
}

namespace {

/// Where OMP_PROC_BIND is set, OpenMP has bound this thread to one place before main begins, and
/// what the process becomes, or starts, would have no other. Gives back all places there were.
void leave_place() {
#ifdef _OPENMP
  cpu_set_t all;
  CPU_ZERO(&all);
  for (int place = 0; place < omp_get_num_places(); ++place) {
    std::vector<int> cpus(static_cast<std::size_t>(omp_get_place_num_procs(place)));
    omp_get_place_proc_ids(place, cpus.data());
    for (int const cpu : cpus)
      if (cpu < CPU_SETSIZE) CPU_SET(static_cast<unsigned>(cpu), &all);
  }
  if (CPU_COUNT(&all) > 0) sched_setaffinity(0, sizeof all, &all);
#endif
}

}  // namespace

int hand_over(std::string const& program, char** argv, std::string const& what) {
  leave_place();
  if (char const* build = std::getenv("TAUT_BUILD")) {
    if (std::system(fmt::format("{} {}", build, program).c_str()) != 0) {
      fmt::print(stderr, "taut: {} is of {}, which could not be built\n", what, program);
      return 1;
    }
  }
  std::filesystem::path const path =
      std::filesystem::read_symlink("/proc/self/exe").replace_filename(program);
  execv(path.c_str(), argv);
  fmt::print(stderr,
             "taut: {} is of {}, which cannot be started: build it (the script ./taut does, or "
             "cmake --build with --target {})\n",
             what, path.string(), program);
  return 1;
}

int ending_in_words(std::function<int()> const& command) {
  constexpr char const* out_of_memory = "out of memory: lower the resolution, or use fewer objects";
  try {
    return command();
  } catch (LeftToTheWhole const&) {
    throw;
  } catch (Error const& error) {
    fmt::print(stderr, "taut: {}\n", error.what());
  } catch (std::bad_alloc const&) {
    fmt::print(stderr, "taut: {}\n", out_of_memory);
  } catch (std::exception const& error) {
    // Kokkos has no type of its own for what it could not allocate.
    std::string_view const words = error.what();
    bool const memory = words.find("failed to allocate") != words.npos;
    fmt::print(stderr, "taut: {}{}{}\n", memory ? out_of_memory : "", memory ? ": " : "", words);
  }
  return 1;
}

}  // namespace taut
