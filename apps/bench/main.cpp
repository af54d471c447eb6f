// The program `taut_bench`, which `taut bench` hands over to: maps the command line onto the
// benches.
#include <taut/apps/bench/contact.hpp>
#include <taut/apps/bench/elastic.hpp>
#include <taut/apps/bench/hot.hpp>
#include <taut/apps/program/parse_command_line.hpp>

#include <fmt/core.h>
#include <CLI/CLI.hpp>

namespace {

using namespace taut;

/// What all benches take.
template <class Options>
void add_bench(CLI::App& command, Options& options, std::string const& quick) {
  if constexpr (requires { options.precisions; })
    add_list(command, "--precisions", options.precisions, "fp32, mixed, fp64");
  command.add_option("--seconds", options.seconds, "spent on each number")->capture_default_str();
  command.add_flag("--json", options.json, "a JSON list of rows");
  command.add_flag("--quick", options.quick, quick);
  add_list(command, "--threads", options.threads, "numbers of threads (1 and all)")
      ->check(CLI::Range(1, 4096));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"measures kernels against the machine's limits", "taut bench"};
  app.footer("example: taut bench elastic --quick");
  app.require_subcommand(1);
  std::function<int()> command;

  BenchOptions bench;
  auto* elastic_app = app.add_subcommand("elastic", "the elastic sweeps and an iteration");
  add_list(*elastic_app, "--materials", bench.materials, "models (all)");
  add_list(*elastic_app, "--tets", bench.tets, "sizes of the mesh");
  add_bench(*elastic_app, bench,
            "a small mesh and hasty numbers, where --tets and --seconds say nothing");
  elastic_app->footer("example: taut bench elastic --materials stable_neo_hookean --tets 500000");
  elastic_app->callback([&] { command = [&] { return bench_command(bench); }; });

  ContactBenchOptions contact_bench;
  auto* contact_app = app.add_subcommand("contact", "search, sweeps and step bounds of contact");
  add_list(*contact_app, "--contacts", contact_bench.contacts, "about so many pairs that act");
  contact_app->add_option("--iterations", contact_bench.iterations, "of a step")
      ->capture_default_str();
  add_bench(*contact_app, contact_bench,
            "a small scene and haste, where --contacts and --seconds say nothing");
  contact_app->footer("example: taut bench contact --contacts 100000 --threads 2");
  contact_app->callback([&] { command = [&] { return bench_contact_command(contact_bench); }; });

  HotBenchOptions hot;
  auto* hot_app = app.add_subcommand("hot", "transfers, sweeps and cycles of material points");
  add_list(*hot_app, "--cells", hot.cells, "cells along an edge of the cube");
  add_bench(*hot_app, hot, "a small grid and haste, where --cells and --seconds say nothing");
  hot_app->footer("example: taut bench hot --cells 32 --threads 1");
  hot_app->callback([&] { command = [&] { return bench_hot_command(hot); }; });

  if (auto const status = parse_command_line(app, argc, argv)) return *status;
  return ending_in_words(command);  // a bench starts Kokkos itself, once per number of threads
}
