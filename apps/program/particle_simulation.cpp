#include <taut/apps/program/particle_methods.hpp>
#include <taut/apps/program/particle_simulation.hpp>
#include <taut/core/report/error.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/invariants.hpp>
#include <taut/mpm/particle_stepper.hpp>

#include <algorithm>
#include <cmath>

namespace taut {
namespace {

/// The transfer policies behind one type.
struct AnyTransfer {
  static constexpr char const* name = "chosen";
  double flip = 0;
  double keep = 1, turn = 0;  ///< C becomes keep C + turn C^T
  KOKKOS_FUNCTION Mat3<double> affine(Mat3<double> const& C) const {
    return keep * C + turn * transpose(C);
  }
};

AnyTransfer transfer_of(ParticleScene const& scene) {
  if (scene.transfer == "rpic") return {0, 0.5, -0.5};
  if (scene.transfer == "flip") return {scene.flip, 0, 0};
  return {};
}

class ParticleSimulationOf final : public ParticleSimulation {
public:
  using P = ParticlePrecision;
  using S = DefaultSpace;
  using Flows = FlowOfMaterials<S>;
  using Stepper =
      ParticleStepper<ImplicitEuler<ParticleMinimiser>, ParticleKernel, AnyTransfer, Flows>;

  ParticleSimulationOf(Scene const& scene, SceneParticles const& start)
      : scene_(scene),
        points_(*scene.particles),
        drawings_(start.drawings),
        particles_(start.list),
        grid_(points_.spacing, particle_lanes()),
        potential_(make_potential(start)),
        boundaries_(boundary_specs(points_)),
        stepper_(ImplicitEuler<ParticleMinimiser>(scene.solver, lagging()),
                 {points_.cfl, points_.crossing, points_.halvings}, transfer_of(points_),
                 Flows(start.flows)) {}

  NewtonReport step(IterationObserver const& observer) override {
    Observer<P, S> inner;
    if (observer) {
      inner = [&](Iteration<P, S> const& i) {
        observer({i.index, i.energy_change_so_far, i.error_estimate, [&] { return read(i.x); }});
      };
    }
    double const end = (steps_ + 1) * scene_.step;
    NewtonReport all;
    frame_ = {};
    while (time_ < end) {
      auto const report = step_of_grid(end, inner);
      time_ = report.time_step >= end - time_ ? end : time_ + report.time_step;
      add(report.minimiser, all);
      ++frame_.steps;
      frame_.converged_steps += report.minimiser.converged();
      frame_.halvings += report.halvings;
      frame_.nodes = std::max(frame_.nodes, report.nodes);
      frame_.travel_cells = std::max(frame_.travel_cells, report.travel_cells);
    }
    ++steps_;
    return all;
  }

  double time() const override { return time_; }
  int steps() const override { return steps_; }
  std::optional<ContactReport> contact() const override { return {}; }
  ParticleFrame const& frame() const override { return frame_; }
  std::vector<Particle> particles() const override { return particles_.read(); }

  std::vector<Point> positions() const override {
    std::vector<Point> all;
    for (Particle const& p : particles_.read()) all.push_back({p.x[0], p.x[1], p.x[2]});
    for (std::size_t k = 0; k < drawings_.size(); ++k) {
      SceneBoundary const& boundary = points_.boundaries[k];
      // What has been taken away is drawn where it was last.
      RigidMap const map = boundary.motion.at(std::min(time_, boundary.release.value_or(time_)));
      for (Point const& x : drawings_[k].points) all.push_back(map(x));
    }
    return all;
  }
  /// Of boundaries, which only show where they are, zero.
  std::vector<Point> velocities() const override {
    std::vector<Point> all;
    for (Particle const& p : particles_.read()) all.push_back({p.v[0], p.v[1], p.v[2]});
    all.resize(all.size() + drawn(), Point{});
    return all;
  }
  std::vector<std::vector<double>> scalars() const override {
    std::vector<std::vector<double>> all(3);
    for (Particle const& p : particles_.read()) {
      all[0].push_back(determinant(p.F));
      all[1].push_back(p.plastic);
      all[2].push_back(p.stiffness);
    }
    constexpr double of_boundaries[] = {1, 0, 1};
    for (std::size_t k = 0; k < all.size(); ++k) {
      all[k].resize(all[k].size() + drawn(), of_boundaries[k]);
    }
    return all;
  }

  void save(Checkpoint& checkpoint) const override {
    checkpoint.set("time", std::vector<double>{time_});
    checkpoint.set("steps", std::vector<std::int32_t>{steps_});
    std::vector<double> numbers;
    for (Particle const& p : particles_.read()) {
      for (int c = 0; c < 3; ++c) numbers.push_back(p.x[c]);
      for (int c = 0; c < 3; ++c) numbers.push_back(p.v[c]);
      numbers.insert(numbers.end(), std::begin(p.C.a), std::end(p.C.a));
      numbers.insert(numbers.end(), std::begin(p.F.a), std::end(p.F.a));
      numbers.push_back(p.stiffness);
      numbers.push_back(p.plastic);
    }
    checkpoint.set("particles", numbers);
  }
  void restore(Checkpoint const& checkpoint) override {
    std::vector<Particle> list = particles_.read();
    auto const& numbers = checkpoint.get<double>("particles");
    constexpr std::size_t each = 3 + 3 + 9 + 9 + 2;
    if (numbers.size() != each * list.size()) {
      throw Error(
          "the checkpoint holds {} numbers of particles, the scene needs {}; start the run "
          "again",
          numbers.size(), each * list.size());
    }
    auto next = numbers.begin();
    for (Particle& p : list) {
      for (int c = 0; c < 3; ++c) p.x[c] = *next++;
      for (int c = 0; c < 3; ++c) p.v[c] = *next++;
      for (double& entry : p.C.a) entry = *next++;
      for (double& entry : p.F.a) entry = *next++;
      p.stiffness = *next++;
      p.plastic = *next++;
    }
    particles_ = Particles<P, S>(list);
    time_ = checkpoint.number<double>("time");
    steps_ = checkpoint.number<std::int32_t>("steps");
  }

private:
  ParticlePotential make_potential(SceneParticles const& start) {
    std::vector<Lame<double>> materials;
    for (MaterialParameters const& m : start.materials) {
      if (m.model != start.materials.front().model) {
        throw Error("{}: objects of {} and of {}: all material points of a scene have one model",
                    scene_.file.string(), start.materials.front().model, m.model);
      }
      materials.push_back(lame_parameters(m.young, m.poisson));
    }
    ParticleTerms terms;
    add_particle_term(terms, start.materials.front().model, materials);
    Point const& g = scene_.gravity;
    auto const& unknowns = grid_.unknowns();
    return ParticlePotential(unknowns, Inertia<P>(unknowns),
                             BodyForce<P>(unknowns, {g[0], g[1], g[2]}), terms, Slip<P>());
  }
  /// Friction takes its forces from the minimisation before, and what separates is held or let go
  /// between minimisations: as often as something changes, which is rarely more than twice.
  Lagging lagging() const {
    int passes = 1;
    for (SceneBoundary const& b : points_.boundaries) {
      if (b.friction > 0) passes = std::max(passes, 2);
      if (b.law == BoundaryLaw::separate) passes = 8;
    }
    return {passes};
  }

  /// One step towards the end of the frame. The last two steps share what is left, so that none is
  /// tiny.
  ParticleStepReport<NewtonReport> step_of_grid(double end, Observer<P, S> const& observer) {
    double const left = end - time_;
    double const longest = points_.longest_step.value_or(left);
    // What round-off has added to the frame is no step of its own.
    double h = stepper_.cfl_step(particles_, points_.spacing,
                                 left <= longest * (1 + 1e-9) ? left : longest);
    if (h < left && 2 * h > left) h = left / 2;
    try {
      return stepper_.step(potential_, grid_, particles_, h, boundaries_, time_, observer);
    } catch (Error const& error) {
      throw Error("step {} at {:.6g} s: {}", steps_ + 1, time_, error.what());
    }
  }

  /// Sums, and the worst of what does not add up.
  static void add(NewtonReport const& one, NewtonReport& all) {
    bool const first = all.stop == Stop::none;
    Stop const worst = !first && !all.converged() ? all.stop : one.stop;
    double const error =
        first ? one.error_estimate_m : std::max(all.error_estimate_m, one.error_estimate_m);
    double const error_mps =
        first ? one.error_estimate_mps : std::max(all.error_estimate_mps, one.error_estimate_mps);
    double const floor = std::max(all.error_floor_m, one.error_floor_m);
    all = first ? one : in_sequence(all, one);
    all.stop = worst;
    all.error_estimate_m = error;
    all.error_estimate_mps = error_mps;
    all.error_floor_m = floor;
  }

  static std::vector<Point> read(VectorField<P::position, S> const& field) {
    auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), field);
    std::vector<Point> to(host.extent(0));
    for (std::size_t i = 0; i < to.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) to[i][c] = host(i, c);
    return to;
  }
  std::size_t drawn() const {
    std::size_t points = 0;
    for (TriangleMesh const& drawing : drawings_) points += drawing.points.size();
    return points;
  }

  Scene scene_;
  ParticleScene points_;
  std::vector<TriangleMesh> drawings_;
  Particles<P, S> particles_;
  ProgramGrid grid_;
  ParticlePotential potential_;
  BoundaryList<S> boundaries_;
  Stepper stepper_;
  ParticleFrame frame_;
  double time_ = 0;
  int steps_ = 0;
};

}  // namespace

std::unique_ptr<ParticleSimulation> ParticleSimulation::create(Scene const& scene,
                                                               SceneParticles const& particles) {
  return std::make_unique<ParticleSimulationOf>(scene, particles);
}

std::vector<std::size_t> broken_particles(std::vector<Particle> const& particles) {
  std::vector<std::size_t> broken;
  for (std::size_t p = 0; p < particles.size(); ++p) {
    Particle const& particle = particles[p];
    double const sum = norm(particle.x) + norm(particle.v);
    if (!(determinant(particle.F) > 0) || !std::isfinite(sum)) broken.push_back(p);
  }
  return broken;
}

}  // namespace taut
