#include <taut/apps/chart/method.hpp>
#include <taut/apps/chart/scene.hpp>
#include <taut/apps/chart/table.hpp>
#include <taut/apps/program/memory.hpp>
#include <taut/apps/program/particle_simulation.hpp>
#include <taut/core/report/error.hpp>

#include <array>
#include <cmath>
#include <limits>

namespace taut {
namespace {

/// The scene as it is loaded by its own rules in fp64, and for the reference.
class LoadedScene : public ChartScene {
public:
  LoadedScene(std::filesystem::path const& file, SceneChanges const& changes,
              std::function<Scene(Scene)> const& change)
      : scene_(change(load_scene(file, changes))),
        lead_scene_(change(
            load_scene(file, with(changes, std::array{std::string("solver.precision=fp64")})))),
        reference_(change(reference_scene(file, changes))) {}

  ReferenceStep advance_to(int step) override {
    if (step <= last_) {
      throw Error("--frame {}: name frames from 1 on, each once, in ascending order", step);
    }
    last_ = step;
    while (lead().steps() + 1 < step) lead().step();
    Checkpoint before;
    lead().save(before);
    return solve(before, step);
  }

protected:
  virtual Simulation& lead() = 0;

  Scene scene_, lead_scene_, reference_;

private:
  int last_ = 0;
};

class MeshScene final : public LoadedScene {
public:
  using LoadedScene::LoadedScene;

  std::string description() const override { return describe(scene_, geometry_); }
  std::string size() const override { return fmt::format("{} tets", geometry_.mesh.tets.size()); }
  ReferenceStep solve(Checkpoint const& before, int step) override {
    if (!solver_) solver_ = Simulation::create(reference_, geometry_);
    return solve_reference(*solver_, before, step);
  }
  std::unique_ptr<StepMeasure> measure(ReferenceStep const& step,
                                       std::optional<double> length) const override {
    return std::make_unique<MeshMeasure>(scene_, geometry_, step.step, step.start, step.solution,
                                         length);
  }
  std::unique_ptr<Simulation> contestant(Scene const& scene) const override { return whole(scene); }
  std::unique_ptr<Simulation> whole(Scene const& scene) const override {
    return Simulation::create(scene, geometry_);
  }
  int grid_steps(Simulation const&) const override { return 1; }

private:
  Simulation& lead() override {
    if (!lead_) lead_ = Simulation::create(lead_scene_, geometry_);
    return *lead_;
  }

  SceneGeometry geometry_ = build_within_memory(scene_);
  std::unique_ptr<Simulation> lead_, solver_;  ///< once they are needed
};

/// Material points of which a step is the first one of the grid in a frame.
class NodesOfParticles final : public Simulation {
public:
  NodesOfParticles(Scene const& scene, SceneParticles const& particles)
      : particles_(ParticleSimulation::create(scene, particles)) {}

  NewtonReport step(IterationObserver const& observer) override {
    NewtonReport const report = particles_->first_step(observer);
    nodes_ = particles_->nodes();
    return report;
  }
  double time() const override { return particles_->time(); }
  int steps() const override { return particles_->steps(); }
  std::optional<ContactReport> contact() const override { return {}; }
  std::vector<Point> positions() const override { return nodes_.x; }
  std::vector<Point> velocities() const override { return {}; }
  void save(Checkpoint& checkpoint) const override { particles_->save(checkpoint); }
  void restore(Checkpoint const& checkpoint) override {
    particles_->restore(checkpoint);
    nodes_ = particles_->start_nodes();
  }
  std::vector<double> const& mass() const { return nodes_.mass; }

  /// Makes grid and potential of the step that begins in a state, and takes none of it. Throws
  /// Error if that step has no iteration.
  void begin(Checkpoint const& before) {
    struct Begun {};
    restore(before);
    try {
      particles_->first_step([](IterationView const&) { throw Begun(); });
    } catch (Begun const&) {
      return;
    }
    throw Error("step {} ends where it begins: compare another one with --frame", steps() + 1);
  }
  /// In the step that was begun.
  std::vector<double> residuals(std::vector<Point> const& x) const {
    return particles_->characteristic_residuals(x);
  }

private:
  std::unique_ptr<ParticleSimulation> particles_;
  NodesOfStep nodes_;
};

class NodeMeasure final : public StepMeasure {
public:
  /// `begun` has begun the step.
  NodeMeasure(std::vector<double> mass, ReferenceStep const& step, std::optional<double> length,
              std::unique_ptr<NodesOfParticles> begun)
      : mass_(std::move(mass)), solution_(step.solution), begun_(std::move(begun)) {
    length_ = length ? *length : distance(step.start);
    if (!(length_ > 0)) {
      throw Error("nothing moves in the first step of frame {}: compare another one with --frame",
                  step.step);
    }
  }
  double length() const override { return length_; }
  double position_error(std::vector<Point> const& x) const override {
    return distance(x) / length_;
  }
  double energy_gap(std::vector<Point> const&) const override {
    return std::numeric_limits<double>::quiet_NaN();
  }
  std::vector<double> errors(std::vector<Point> const& x) const override {
    std::vector<double> all = distances(x, solution_);
    for (double& one : all) one /= length_;
    return all;
  }
  std::vector<double> residuals(std::vector<Point> const& x) const override {
    return begun_->residuals(x);
  }

private:
  double distance(std::vector<Point> const& x) const {
    double sum = 0, mass = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      for (int c = 0; c < 3; ++c)
        sum += mass_[i] * (x[i][c] - solution_[i][c]) * (x[i][c] - solution_[i][c]);
      mass += mass_[i];
    }
    return std::sqrt(sum / mass);
  }

  std::vector<double> mass_;
  std::vector<Point> solution_;
  std::unique_ptr<NodesOfParticles> begun_;
  double length_ = 0;
};

class PointScene final : public LoadedScene {
public:
  using LoadedScene::LoadedScene;

  std::string description() const override {
    return describe(scene_,
                    fmt::format("# particles = {}\n# spacing_m = {:g}\n", particles_.list.size(),
                                scene_.particles->spacing),
                    particles_.materials);
  }
  std::string size() const override { return fmt::format("{} particles", particles_.list.size()); }
  ReferenceStep solve(Checkpoint const& before, int step) override {
    if (!solver_) solver_ = std::make_unique<NodesOfParticles>(reference_, particles_);
    return solve_reference(*solver_, before, step);
  }
  std::unique_ptr<StepMeasure> measure(ReferenceStep const& step,
                                       std::optional<double> length) const override {
    auto begun = std::make_unique<NodesOfParticles>(reference_, particles_);
    begun->begin(step.before);
    return std::make_unique<NodeMeasure>(solver_->mass(), step, length, std::move(begun));
  }
  std::unique_ptr<Simulation> contestant(Scene const& scene) const override {
    return std::make_unique<NodesOfParticles>(scene, particles_);
  }
  std::unique_ptr<Simulation> whole(Scene const& scene) const override {
    return ParticleSimulation::create(scene, particles_);
  }
  int grid_steps(Simulation const& whole) const override {
    return dynamic_cast<ParticleSimulation const&>(whole).frame().steps;
  }

private:
  Simulation& lead() override {
    if (!lead_) lead_ = ParticleSimulation::create(lead_scene_, particles_);
    return *lead_;
  }

  SceneParticles particles_ = build_particles(scene_);
  std::unique_ptr<ParticleSimulation> lead_;
  std::unique_ptr<NodesOfParticles> solver_;
};

}  // namespace

std::unique_ptr<ChartScene> make_chart_scene(std::filesystem::path const& file,
                                             SceneChanges const& changes,
                                             std::function<Scene(Scene)> const& change) {
  auto const as_it_is = [](Scene scene) { return scene; };
  std::function<Scene(Scene)> const apply = change ? change : as_it_is;
  if (load_scene(file, changes).particles) {
    return std::make_unique<PointScene>(file, changes, apply);
  }
  return std::make_unique<MeshScene>(file, changes, apply);
}

}  // namespace taut
