#include <taut/apps/bench/process.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/ranges.h>
#include <Kokkos_Core.hpp>
#include <nlohmann/json.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

namespace taut {

nlohmann::json measure_in_process(int threads, double seconds, std::string_view smaller,
                                  std::function<nlohmann::json(MachineRates const&)> const& measure,
                                  MachineRates& machine) {
  if (Kokkos::is_initialized())
    throw Error("bench: Kokkos runs already: this is a mistake of ours");
  fmt::print(stderr, "taut: measuring with {} thread{}\n", threads, threads == 1 ? "" : "s");
  int ends[2];
  if (pipe(ends) != 0) throw Error("bench: no pipe can be made: close other programs");
  pid_t const child = fork();
  if (child < 0) throw Error("bench: no process can be made: close other programs");
  if (child == 0) {
    close(ends[0]);
    int status = 1;
    try {
      Kokkos::InitializationSettings settings;
      Kokkos::ScopeGuard const kokkos(settings.set_num_threads(threads).set_disable_warnings(true));
      MachineRates const m = measure_machine(seconds);
      nlohmann::json const sent_json = {{"machine", {m.threads, m.triad, m.fma32, m.fma64}},
                                        {"measured", measure(m)}};
      std::string const text = sent_json.dump();
      std::FILE* pipe_end = fdopen(ends[1], "w");
      bool const sent = std::fwrite(text.data(), 1, text.size(), pipe_end) == text.size();
      status = std::fclose(pipe_end) == 0 && sent ? 0 : 1;
    } catch (std::exception const& error) {
      fmt::print(stderr, "taut: {}\n", error.what());
    }
    _exit(status);
  }
  close(ends[1]);
  std::string text;
  char buffer[4096];
  for (ssize_t n; (n = read(ends[0], buffer, sizeof buffer)) > 0;) text.append(buffer, n);
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    throw Error("bench: the measurement with {} threads ended early: give it smaller {}", threads,
                smaller);
  }
  nlohmann::json const received = nlohmann::json::parse(text);
  auto const& m = received.at("machine");
  machine = {m.at(0), m.at(1), m.at(2), m.at(3)};
  return received.at("measured");
}

std::vector<int> bench_threads(std::vector<int> const& asked) {
  if (!asked.empty()) return asked;
  std::vector<int> threads{1};
  int const all = static_cast<int>(std::thread::hardware_concurrency());
  if (all > 1) threads.push_back(all);
  return threads;
}

void require_known(char const* option, std::vector<std::string> const& words,
                   std::vector<std::string_view> const& known) {
  for (std::string const& word : words)
    if (std::find(known.begin(), known.end(), word) == known.end())
      throw Error("{} {}: choose of {}", option, word, fmt::join(known, ", "));
}

}  // namespace taut
