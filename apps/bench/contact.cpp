#include <taut/apps/bench/contact.hpp>
#include <taut/apps/bench/contact_scene.hpp>
#include <taut/apps/bench/process.hpp>
#include <taut/core/exec/space.hpp>
#include <taut/core/report/error.hpp>
#include <taut/core/report/record.hpp>
#include <taut/core/report/report_log.hpp>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace taut {

template <class P>
void measure_contact_scene(ContactScene const& scene, ContactBenchOptions const& options,
                           MachineRates const& machine, std::vector<ContactRow>& rows);

std::vector<ContactRow> measure_contact(ContactBenchOptions const& options,
                                        MachineRates const& machine) {
  std::vector<ContactRow> rows;
  for (int contacts : options.contacts) {
    ContactScene const scene(contacts);
    std::size_t const first = rows.size();
    for (std::string const& precision : options.precisions) {
      if (precision == "mixed") {
        measure_contact_scene<Mixed>(scene, options, machine, rows);
      } else if (precision == "fp64") {
        measure_contact_scene<Fp64>(scene, options, machine, rows);
      } else {
        throw Error("--precisions {}: choose of mixed and fp64", precision);
      }
    }
    for (std::size_t k = first; k < rows.size(); ++k) rows[k].asked = contacts;
  }
  return rows;
}

std::string to_json(std::vector<ContactRow> const& rows) {
  std::vector<Record> records;
  for (ContactRow const& row : rows) {
    Record& record = records.emplace_back();
    record.set("precision", row.precision)
        .set("threads", row.threads)
        .set("kernel", row.kernel)
        .set("asked", row.asked)
        .set("contacts", row.contacts)
        .set("candidates", row.candidates)
        .set("kept", row.kept)
        .set("tets", row.tets)
        .set("seconds", row.seconds)
        .set("fraction", row.fraction)
        .set("bytes", row.bytes)
        .set("flops", row.flops);
    if (row.kernel == "iteration") {
      record.set("held_bytes", row.held)
          .set("peak_bytes", row.peak)
          .set("searches", row.searches)
          .set("search_share", row.search_share)
          .set("bound_share", row.bound_share)
          .set("allocations", row.allocations);
    }
  }
  return to_json(records);
}

std::vector<ContactRow> contact_rows(std::string const& json) {
  std::vector<ContactRow> rows;
  for (auto const& row : nlohmann::json::parse(json)) {
    rows.push_back({row.at("precision"), row.at("threads"), row.at("kernel"), row.at("asked"),
                    row.at("contacts"), row.at("candidates"), row.at("kept"), row.at("tets"),
                    row.at("seconds"), row.at("bytes"), row.at("flops"), row.at("fraction"),
                    row.value("held_bytes", 0.0), row.value("peak_bytes", 0.0),
                    row.value("searches", 0.0), row.value("search_share", 0.0),
                    row.value("bound_share", 0.0), row.value("allocations", 0)});
  }
  return rows;
}

namespace {

void check_options(ContactBenchOptions const& options) {
  require_known("--precisions", options.precisions, {"mixed", "fp64"});
  for (int contacts : options.contacts)
    if (contacts < 100 || contacts > 10'000'000)
      throw Error("--contacts {}: it must be 100 to 10000000", contacts);
  if (options.iterations < 2 || options.iterations > 10'000)
    throw Error("--iterations {}: it must be 2 to 10000", options.iterations);
  if (!(options.seconds > 0)) throw Error("--seconds {}: it must be above 0", options.seconds);
}

}  // namespace

int bench_contact_command(ContactBenchOptions const& asked) {
  check_options(asked);
  ContactBenchOptions options = asked;
  if (options.quick) {  // what the user has named stays
    ContactBenchOptions const defaults;
    if (options.contacts == defaults.contacts) options.contacts = {5'000};
    if (options.seconds == defaults.seconds) options.seconds = 0.02;
  }
  std::vector<ContactRow> rows;
  std::vector<MachineRates> machines;
  for (int threads : bench_threads(options.threads)) {
    auto const measure = [&](MachineRates const& machine) {
      return nlohmann::json(to_json(measure_contact(options, machine)));
    };
    nlohmann::json const text = measure_in_process(threads, options.seconds, "--contacts", measure,
                                                   machines.emplace_back());
    std::vector<ContactRow> const measured = contact_rows(text.get<std::string>());
    rows.insert(rows.end(), measured.begin(), measured.end());
  }
  fmt::print("{}", options.json ? to_json(rows) + "\n" : contact_tables(rows, machines));
  return 0;
}

}  // namespace taut
