// `taut run` for scenes of material points.
#include <taut/apps/program/particle_methods.hpp>
#include <taut/apps/program/particle_simulation.hpp>
#include <taut/apps/program/run_identity.hpp>
#include <taut/apps/program/run_loop.hpp>
#include <taut/core/report/error.hpp>

#include <fmt/core.h>

#include <algorithm>

namespace taut {
namespace {

class ParticleRun final : public RunLoop {
public:
  ParticleRun(Scene const& scene, SceneParticles const& particles, RunOptions const& options)
      : RunLoop(scene, options, result_mesh(scene, particles),
                run_identity(options.scene.changes, scene, particles)),
        scene_(scene),
        particles_(particles),
        simulation_(ParticleSimulation::create(scene, particles)) {
    if (scene.output.vdb) write_grid_late.require(vdb);
  }

private:
  static constexpr char const* vdb = "output.vdb = true";

  Simulation& simulation() override { return *simulation_; }
  NewtonReport step() override {
    try {
      return simulation_->step();
    } catch (Error const&) {
      write_frame_off_grid(within_frame());  // the state before what cannot be done
      throw;
    }
  }

  /// Of the steps of a frame some have been taken, but not all.
  bool within_frame() const { return simulation_->time() != simulation_->steps() * scene_.step; }

  void add_to_line(Record& line) override {
    ParticleFrame const& frame = simulation_->frame();
    totals().grid_steps += frame.steps;
    totals().halvings += frame.halvings;
    totals().most_nodes = std::max(totals().most_nodes, double(frame.nodes));
    line.set("grid_steps", frame.steps)
        .set("grid_steps_converged", frame.converged_steps)
        .set("grid_steps_unsettled", frame.unsettled_steps)
        .set("halvings", frame.halvings)
        .set("particles", simulation_->particle_count())
        .set("nodes", frame.nodes)
        .set("travel_cells", frame.travel_cells);
    if (!scene_.output.check) return;
    auto const broken = broken_particles(simulation_->particles()).size();
    totals().most_inverted = std::max(totals().most_inverted, static_cast<double>(broken));
    totals().inverted_steps += broken > 0;
    line.set("inverted", broken);
  }

  void append_frame(ResultWriter& result) override {
    result.append(simulation_->time(), simulation_->positions(), simulation_->velocities(),
                  simulation_->scalars());
    if (!scene_.output.vdb || within_frame()) return;
    write_grid_late(vdb, folder() / "vdb" / fmt::format("frame_{:05}.vdb", simulation_->steps()),
                    simulation_->grid());
  }

  void add_to_summary(Record& summary) const override {
    double mass = 0;
    std::size_t const count = simulation_->particle_count();
    for (std::size_t p = 0; p < count; ++p) mass += particles_.list[p].mass;
    summary.set("particles", count)
        .set("nodes", static_cast<std::int64_t>(totals().most_nodes))
        .set("mass_kg", mass)
        .set("preconditioner", particle_preconditioner(scene_.solver))
        .set("grid_steps", static_cast<std::int64_t>(totals().grid_steps))
        .set("halvings", static_cast<std::int64_t>(totals().halvings))
        .set("most_inverted_elements", static_cast<std::int64_t>(totals().most_inverted))
        .set("steps_with_inverted_elements", static_cast<std::int64_t>(totals().inverted_steps))
        .set("warnings", particles_.warnings);
  }

  void say_more() const override {
    fmt::print("grid     {:.0f} steps, {:.0f} halvings; {} particles, {:.0f} nodes at most\n",
               totals().grid_steps, totals().halvings, simulation_->particle_count(),
               totals().most_nodes);
    if (totals().inverted_steps > 0) {
      fmt::print("inverted particles in {:.0f} of {:.0f} steps, at most {:.0f} at a time\n",
                 totals().inverted_steps, totals().steps, totals().most_inverted);
    }
  }

  Scene const& scene_;
  SceneParticles const& particles_;
  std::unique_ptr<ParticleSimulation> simulation_;
};

}  // namespace

int run_particles(Scene const& scene, RunOptions const& options) {
  if (options.check != CheckRun::off) {
    throw Error(
        "{}: --check looks for surfaces that intersect, and material points have none: leave it "
        "out",
        scene.file.string());
  }
  if (scene.output.obj) {
    throw Error("{}: output.obj writes surfaces, and material points have none: leave it out",
                scene.file.string());
  }
  SceneParticles const particles = build_particles(scene);
  for (std::string const& warning : particles.warnings)
    fmt::print(stderr, "warning: {}\n", warning);
  return ParticleRun(scene, particles, options).run();
}

}  // namespace taut
