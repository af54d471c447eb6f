#include <taut/apps/bench/elastic.hpp>
#include <taut/apps/bench/process.hpp>
#include <taut/apps/bench/table.hpp>
#include <taut/apps/program/scene.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/record.hpp>
#include <taut/core/report/report_log.hpp>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace taut {
namespace {

std::vector<BenchRow> from_json(nlohmann::json const& list) {
  std::vector<BenchRow> rows;
  for (auto const& row : list) {
    rows.push_back({row.at("material"), row.at("precision"), row.at("threads"), row.at("tets"),
                    row.at("kernel"), row.at("ns_per_tet"), row.at("bytes"), row.at("flops"),
                    row.at("fraction"), row.value("held_bytes", 0.0),
                    row.value("resident_bytes", 0.0), row.value("allocations", 0)});
  }
  return rows;
}

}  // namespace

std::string to_json(std::vector<BenchRow> const& rows) {
  std::vector<Record> records;
  for (BenchRow const& row : rows) {
    Record& record = records.emplace_back();
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
  }
  return to_json(records);
}

namespace {

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
  BenchOptions options = asked;
  if (options.quick) {  // what the user has named stays
    BenchOptions const defaults;
    if (options.tets == defaults.tets) options.tets = {20'000};
    if (options.seconds == defaults.seconds) options.seconds = 0.02;
  }
  std::vector<BenchRow> rows;
  std::vector<MachineRates> machines;
  for (int threads : bench_threads(options.threads)) {
    auto const measure = [&](MachineRates const& machine) {
      return nlohmann::json::parse(to_json(measure_elastic(options, machine)));
    };
    std::vector<BenchRow> const measured = from_json(
        measure_in_process(threads, options.seconds, "--tets", measure, machines.emplace_back()));
    rows.insert(rows.end(), measured.begin(), measured.end());
  }
  fmt::print("{}", options.json ? to_json(rows) + "\n" : bench_tables(rows, machines));
  return 0;
}

}  // namespace taut
