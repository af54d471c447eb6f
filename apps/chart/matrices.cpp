#include <taut/apps/chart/node_pattern.hpp>
#include <taut/apps/chart/table.hpp>
#include <taut/apps/program/particle_simulation.hpp>
#include <taut/core/report/error.hpp>

namespace taut {
namespace {

/// Rows of pictures, at most.
constexpr int most_bins = 160;

std::string binned(std::string const& label, NodePattern const& pattern) {
  int const n = static_cast<int>(pattern.nodes.size()), bins = std::min(n, most_bins);
  auto const bin = [&](std::int64_t node) { return static_cast<int>(node * bins / n); };
  std::vector<int> counts(static_cast<std::size_t>(bins) * bins);
  for (int i = 0; i < n; ++i) {
    auto const& row = pattern.coupled[i];
    for (int bit = 0; bit < static_cast<int>(row.size()); ++bit) {
      if (!row[bit]) continue;
      NodeAt const d = NodePattern::offset(bit), &at = pattern.nodes[i];
      int const j = pattern.find({at[0] + d[0], at[1] + d[1], at[2] + d[2]});
      ++counts[static_cast<std::size_t>(bin(i)) * bins + bin(j)];
    }
  }
  std::string rows;
  for (int r = 0; r < bins; ++r)
    for (int c = 0; c < bins; ++c) {
      int const blocks = counts[static_cast<std::size_t>(r) * bins + c];
      if (blocks > 0) rows += fmt::format("{},{},{},{},{}\n", label, bins, r, c, blocks);
    }
  return rows;
}

}  // namespace

std::string patterns_of_matrices(std::filesystem::path const& file, ChartOptions const& options,
                                 MoreTables& more) {
  if (options.frames.size() > 1) throw Error("--frame: matrices are those of one frame, name one");
  Scene const scene = load_scene(file, options.scene.changes);
  int const frame = options.frames.empty() ? 1 : options.frames.front();
  if (frame < 1) throw Error("--frame {}: name one from 1 on", frame);
  SceneParticles const start = build_particles(scene);
  std::vector<Vec3<double>> x;
  auto const simulation = ParticleSimulation::create(scene, start);
  while (simulation->steps() + 1 < frame) simulation->step();
  for (Particle const& p : simulation->particles()) x.push_back(p.x);
  if (x.empty()) throw Error("no particle is there yet: take a later --frame");

  double const dx = scene.particles->spacing;
  std::string rows, &patterns = more["patterns.csv"];
  patterns = "hierarchy,level,bins,row,column,blocks\n";
  fmt::print("{}: {} particles\n{:<12} {:>6} {:>10} {:>14} {:>12}\n", scene.name, x.size(), "",
             "level", "nodes", "nonzeros", "per row");
  auto const add = [&](char const* hierarchy, int level, NodePattern const& pattern) {
    double const n = static_cast<double>(pattern.nodes.size());
    std::int64_t const blocks = pattern.blocks();
    std::string const label = fmt::format("{},{}", hierarchy, level);
    double const per_row = 3 * static_cast<double>(blocks) / n;
    rows += fmt::format("{},{},{},{:.6g}\n", label, pattern.nodes.size(), 9 * blocks, per_row);
    patterns += binned(label, pattern);
    fmt::print("{:<12} {:>6} {:>10} {:>14} {:>12.1f}\n", hierarchy, level, pattern.nodes.size(),
               9 * blocks, per_row);
  };
  NodePattern galerkin = pattern_of_points(x, dx);
  add("Galerkin", 0, galerkin);
  for (int level = 1; level < options.levels; ++level) {
    galerkin = coarser_pattern(galerkin);
    add("Galerkin", level, galerkin);
  }
  double spacing = dx;
  for (int level = 1; level < options.levels; ++level) {
    spacing *= 2;
    add("particles", level, pattern_of_points(x, spacing));
  }
  return "# kind = matrices\n" +
         describe(scene,
                  fmt::format("# particles = {}\n# spacing_m = {:g}\n", start.list.size(), dx),
                  start.materials) +
         fmt::format("# frame = {}\nhierarchy,level,nodes,nonzeros,per_row\n", frame) + rows;
}

}  // namespace taut
