#include <taut/apps/program/bench.hpp>
#include <taut/apps/program/bench_table.hpp>
#include <taut/apps/program/scene.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/record.hpp>
#include <taut/core/report/report_log.hpp>

#include <fmt/ranges.h>
#include <Kokkos_Core.hpp>
#include <nlohmann/json.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <thread>

namespace taut {
namespace {

/// What a process hands to its parent.
struct Measured {
  MachineRates machine;
  std::vector<BenchRow> rows;
};

nlohmann::json to_transfer(Measured const& measured) {
  MachineRates const& m = measured.machine;
  return {{"machine", {m.threads, m.triad, m.fma32, m.fma64}},
          {"rows", nlohmann::json::parse(to_json(measured.rows))}};
}

Measured from_transfer(nlohmann::json const& from) {
  auto const& m = from.at("machine");
  Measured measured{{m.at(0), m.at(1), m.at(2), m.at(3)}, {}};
  for (auto const& row : from.at("rows")) {
    measured.rows.push_back({row.at("material"), row.at("precision"), row.at("threads"),
                             row.at("tets"), row.at("kernel"), row.at("ns_per_tet"),
                             row.at("bytes"), row.at("flops"), row.at("fraction"),
                             row.value("held_bytes", 0.0), row.value("resident_bytes", 0.0),
                             row.value("allocations", 0)});
  }
  return measured;
}

/// Kokkos fixes its number of threads at its start: each number gets a process.
Measured in_process_of_its_own(BenchOptions const& options, int threads) {
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
      Measured measured{measure_machine(options.seconds), {}};
      measured.rows = measure_elastic(options, measured.machine);
      std::string const text = to_transfer(measured).dump();
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
    throw Error("bench: the measurement with {} threads ended early: give it smaller --tets",
                threads);
  }
  return from_transfer(nlohmann::json::parse(text));
}

}  // namespace

std::string to_json(std::vector<BenchRow> const& rows) {
  std::string list;
  for (BenchRow const& row : rows) {
    Record record;
    record.set("material", row.material)
        .set("precision", row.precision)
        .set("threads", row.threads)
        .set("tets", row.tets)
        .set("kernel", row.kernel)
        .set("ns_per_tet", row.ns_per_tet)
        .set("fraction", row.fraction)
        .set("bytes", row.bytes)
        .set("flops", row.flops);
    if (row.kernel == "iteration") {
      record.set("held_bytes", row.held)
          .set("resident_bytes", row.resident)
          .set("allocations", row.allocations);
    }
    list += (list.empty() ? "[" : ",\n ") + to_json(record);
  }
  return list.empty() ? "[]" : list + "]";
}

namespace {

void require_known(char const* option, std::vector<std::string> const& words,
                   std::vector<std::string_view> const& known) {
  for (std::string const& word : words)
    if (std::find(known.begin(), known.end(), word) == known.end())
      throw Error("{} {}: choose of {}", option, word, fmt::join(known, ", "));
}

void check_options(BenchOptions const& options) {
  std::vector<std::string_view> models;
  for (MaterialModel const& model : material_models()) models.push_back(model.name);
  require_known("--materials", options.materials, models);
  require_known("--precisions", options.precisions, {"fp32", "mixed", "fp64"});
  for (int tets : options.tets)
    if (tets < 100 || tets > 100'000'000)
      throw Error("--tets {}: it must be 100 to 100000000", tets);
  if (!(options.seconds > 0)) throw Error("--seconds {}: it must be above 0", options.seconds);
}

}  // namespace

int bench_command(BenchOptions const& asked) {
  check_options(asked);
  if (Kokkos::is_initialized())
    throw Error("bench: Kokkos runs already: this is a mistake of ours");
  BenchOptions options = asked;
  if (options.quick) {  // what the user has named stays
    BenchOptions const defaults;
    if (options.tets == defaults.tets) options.tets = {20'000};
    if (options.seconds == defaults.seconds) options.seconds = 0.02;
  }
  if (options.threads.empty()) {
    options.threads = {1};
    int const all = static_cast<int>(std::thread::hardware_concurrency());
    if (all > 1) options.threads.push_back(all);
  }
  std::vector<BenchRow> rows;
  std::vector<MachineRates> machines;
  for (int threads : options.threads) {
    fmt::print(stderr, "taut: measuring with {} thread{}\n", threads, threads == 1 ? "" : "s");
    Measured const measured = in_process_of_its_own(options, threads);
    machines.push_back(measured.machine);
    rows.insert(rows.end(), measured.rows.begin(), measured.rows.end());
  }
  fmt::print("{}", options.json ? to_json(rows) + "\n" : bench_tables(rows, machines));
  return 0;
}

}  // namespace taut
