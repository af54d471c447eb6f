#include <taut/apps/program/particle_methods.hpp>
#include <taut/apps/program/particle_simulation.hpp>
#include <taut/core/exec/copy.hpp>
#include <taut/core/report/error.hpp>
#include <taut/integrators/time_stepper.hpp>
#include <taut/materials/invariants.hpp>
#include <taut/mpm/particle_stepper.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

namespace taut {
namespace {

/// The transfer policies behind one type.
struct AnyTransfer {
  static constexpr char const* name = "chosen";
  enum class Kind { apic, rpic, pic_flip } kind = Kind::apic;
  double flip = 0;
  KOKKOS_FUNCTION Mat3<double> affine(Mat3<double> const& C) const {
    switch (kind) {
      case Kind::rpic:
        return Rpic{}.affine(C);
      case Kind::pic_flip:
        return PicFlip{}.affine(C);
      default:
        return Apic{}.affine(C);
    }
  }
};

AnyTransfer transfer_of(ParticleScene const& scene) {
  if (scene.transfer == "rpic") return {AnyTransfer::Kind::rpic, Rpic::flip};
  if (scene.transfer == "flip") return {AnyTransfer::Kind::pic_flip, scene.flip};
  return {AnyTransfer::Kind::apic, Apic::flip};
}

/// What comes out of a source in a step has gone on with the flow since then.
template <class S, class Scalar>
struct ComeOut {
  VectorField<Scalar, S> x, v;
  Kokkos::View<double const*, typename S::memory> born;
  int first;
  double time;
  KOKKOS_FUNCTION void operator()(int k) const {
    int const p = first + k;
    for (int c = 0; c < 3; ++c) {
      x(p, c) += static_cast<Scalar>((time - born(p)) * double(v(p, c)));
    }
  }
};

/// Mass-weighted squares of what free nodes gain in velocity, and their mass: what a boundary holds
/// goes as it goes, whatever the step.
template <class S, class Precision>
struct Gained {
  using Scalar = typename Precision::position;
  VectorField<Scalar, S> before, after;
  Array<typename Precision::real, S> mass;
  FixedMask<S> fixed;
  KOKKOS_FUNCTION void operator()(int n, Sums<double, 2>& sums) const {
    if (fixed(n)) return;
    double square = 0;
    for (int c = 0; c < 3; ++c) {
      double const gain = double(after(n, c)) - double(before(n, c));
      square += gain * gain;
    }
    sums[0] += double(mass(n)) * square;
    sums[1] += double(mass(n));
  }
};

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
        start_(start),
        particles_(start.list),
        born_("particle_born", start.born.size()),
        grid_(points_.spacing),
        potential_(make_potential(start)),
        boundaries_(start.boundaries),
        stepper_(ImplicitEuler<ParticleMinimiser>(scene.solver, lagging()),
                 {points_.cfl, points_.crossing, points_.halvings}, transfer_of(points_),
                 Flows(start.flows)) {
    auto const born = Kokkos::create_mirror_view(born_);
    for (std::size_t p = 0; p < start.born.size(); ++p) born(p) = start.born[p];
    assign(born_, born);
    particles_.count = static_cast<int>(start.initial());
    for (std::size_t p = start.initial(); p < start.list.size(); ++p) {
      source_speed_ = std::max(source_speed_, norm(start.list[p].v));
    }
    let_out();
  }

  NewtonReport step(IterationObserver const& observer) override {
    Observer<P, S> const inner = observer_of(observer);
    double const end = (steps_ + 1) * scene_.step;
    NewtonReport all;
    frame_ = {};
    while (time_ < end) {
      if (particles_.count == 0) {
        wait(end);
        continue;
      }
      auto const report = step_of_grid(end, inner);
      time_ = report.time_step >= end - time_ ? end : time_ + report.time_step;
      let_out();
      add(report.minimiser, all);
      ++frame_.steps;
      frame_.converged_steps += report.minimiser.converged();
      frame_.unsettled_steps += report.unsettled;
      frame_.halvings += report.halvings;
      frame_.nodes = std::max(frame_.nodes, report.nodes);
      frame_.travel_cells = std::max(frame_.travel_cells, report.travel_cells);
    }
    if (frame_.steps == 0) {  // nothing is there yet
      all.stop = Stop::converged_by_gradient;
      all.error_estimate_m = all.error_estimate_mps = 0;
    }
    ++steps_;
    return all;
  }

  NewtonReport first_step(IterationObserver const& observer) override {
    return step_of_grid((steps_ + 1) * scene_.step, observer_of(observer)).minimiser;
  }
  NodesOfStep nodes() const override { return nodes_at(stepper_.nodes().x); }
  NodesOfStep start_nodes() override {
    if (particles_.count == 0) {
      throw Error("nothing has come out of a source when frame {} begins: compare a later one",
                  steps_ + 1);
    }
    grid_.rebuild(particles_, potential_.template term<ParticleTerms>().materials().end);
    return nodes_at(grid_.rest());
  }
  std::vector<double> characteristic_residuals(std::vector<Point> const& x) const override {
    VectorField<P::position, S> const at("chart_x", x.size());
    VectorField<P::real, S> const g("chart_gradient", x.size());
    Array<double, S> const force("characteristic_force", x.size());
    auto const host = Kokkos::create_mirror_view(at);
    for (std::size_t i = 0; i < x.size(); ++i)
      for (std::size_t c = 0; c < 3; ++c) host(i, c) = x[i][c];
    Kokkos::deep_copy(at, host);
    potential_.gradient(at, g);
    potential_.characteristic_force(force);
    double const h = potential_.scale().time_step;
    std::vector<Point> const gradient = read(g);
    auto const unit = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), force);
    std::vector<double> residuals(x.size(), 0.0);
    for (std::size_t i = 0; i < x.size(); ++i) {
      Point const& own = gradient[i];
      if (unit(i) > 0) residuals[i] = std::hypot(own[0], own[1], own[2]) / (h * h * unit(i));
    }
    return residuals;
  }

  double time() const override { return time_; }
  int steps() const override { return steps_; }
  std::optional<ContactReport> contact() const override { return {}; }
  ParticleFrame const& frame() const override { return frame_; }
  std::vector<Particle> particles() const override { return particles_.read(); }
  std::size_t particle_count() const override { return static_cast<std::size_t>(particles_.count); }

  std::vector<Point> positions() const override {
    std::vector<Point> all;
    for (Particle const& p : particles_.read()) all.push_back({p.x[0], p.x[1], p.x[2]});
    for (std::size_t k = 0; k < start_.drawings.size(); ++k) {
      SceneBoundary const& boundary = points_.boundaries[k];
      // What has been taken away is drawn where it was last.
      RigidMap const map = boundary.motion.at(std::min(time_, boundary.release.value_or(time_)));
      for (Point const& x : start_.drawings[k].points) all.push_back(map(x));
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

  GridOutput grid() const override {
    GridOutput output;
    output.dx = points_.spacing;
    std::vector<Particle> const list = particles_.read();
    for (Particle const& p : list) {
      output.particle.push_back(p.x);
      output.volume += p.volume / static_cast<double>(list.size());
    }
    if (frame_.steps == 0) return output;
    auto const ijk = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid_.nodes().ijk);
    auto const mass =
        Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid_.unknowns().mass);
    auto const v = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), stepper_.nodes().v);
    for (int n = 0; n < grid_.size(); ++n) {
      output.node.push_back({ijk(n, 0), ijk(n, 1), ijk(n, 2)});
      output.mass.push_back(mass(n));
      output.velocity.push_back({v(n, 0), v(n, 1), v(n, 2)});
    }
    return output;
  }

  void save(Checkpoint& checkpoint) const override {
    checkpoint.set("time", std::vector<double>{time_});
    checkpoint.set("steps", std::vector<std::int32_t>{steps_});
    checkpoint.set("next_step", std::vector<double>{next_});
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
    std::vector<Particle> list = start_.list;
    auto const& numbers = checkpoint.get<double>("particles");
    constexpr std::size_t each = 3 + 3 + 9 + 9 + 2;
    time_ = checkpoint.number<double>("time");
    steps_ = checkpoint.number<std::int32_t>("steps");
    next_ = checkpoint.number<double>("next_step");
    std::size_t const count = start_.count_at(time_);
    if (numbers.size() != each * count) {
      throw Error(
          "the checkpoint holds {} numbers of particles, the scene needs {}; start the run "
          "again",
          numbers.size(), each * count);
    }
    auto next = numbers.begin();
    for (Particle& p : std::span(list).first(count)) {
      for (int c = 0; c < 3; ++c) p.x[c] = *next++;
      for (int c = 0; c < 3; ++c) p.v[c] = *next++;
      for (double& entry : p.C.a) entry = *next++;
      for (double& entry : p.F.a) entry = *next++;
      p.stiffness = *next++;
      p.plastic = *next++;
    }
    particles_ = Particles<P, S>(list);
    particles_.count = static_cast<int>(count);
  }

private:
  ParticlePotential make_potential(SceneParticles const& start) {
    std::vector<Lame<double>> materials;
    for (MaterialParameters const& m : start.materials) {
      materials.push_back(lame_parameters(m.young, m.poisson));
    }
    // One term per model: its materials stand together.
    ParticleTerms terms;
    for (std::size_t first = 0, end = 0; first < materials.size(); first = end) {
      std::string const& model = start.materials[first].model;
      while (end < materials.size() && start.materials[end].model == model) ++end;
      add_particle_term(terms, model, std::span(materials).subspan(first, end - first),
                        std::span(start.flows).subspan(first, end - first));
    }
    GhostPenalty<ParticleKernel, P> const ghosts({.strength = points_.ghost_penalty});
    Point const& g = scene_.gravity;
    auto const& unknowns = grid_.unknowns();
    return ParticlePotential(unknowns, Inertia<P>(unknowns),
                             BodyForce<P>(unknowns, {g[0], g[1], g[2]}), terms, ghosts, Slip<P>());
  }
  static Observer<P, S> observer_of(IterationObserver const& observer) {
    if (!observer) return {};
    return [&observer](Iteration<P, S> const& i) {
      observer({i.index, i.energy_change_so_far, i.error_estimate, [&] { return read(i.x); }});
    };
  }
  NodesOfStep nodes_at(VectorField<P::position, S> const& x) const {
    NodesOfStep nodes{read(x), {}};
    auto const mass =
        Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), grid_.unknowns().mass);
    nodes.mass.assign(mass.data(), mass.data() + mass.extent(0));
    return nodes;
  }
  /// Friction takes its forces from the minimisation before, sand that yields in the step its
  /// pressure, and what separates is held or let go between minimisations: as often as something
  /// changes, which is rarely more than twice.
  Lagging lagging() const {
    int passes = 1;
    for (std::size_t k = 0; k < start_.flows.size(); ++k) {
      bool const sand = start_.flows[k].kind == FlowKind::sand;
      if (sand && yields_in_step(start_.materials[k].model, FlowKind::sand)) passes = 4;
    }
    for (SceneBoundary const& b : points_.boundaries) {
      if (b.friction > 0) passes = std::max(passes, 2);
      if (b.law == BoundaryLaw::separate) passes = 8;
    }
    return {passes};
  }

  /// What has come out of the sources by now is there.
  void let_out() {
    int const first = particles_.count, count = static_cast<int>(start_.count_at(time_)) - first;
    for_each<S>("come_out", count,
                ComeOut<S, P::position>{particles_.x, particles_.v, born_, first, time_});
    particles_.count += count;
  }
  /// Until something is there, at most to the end of the frame.
  void wait(double end) {
    time_ = std::clamp(start_.born.front(), time_, end);
    let_out();
  }

  /// One step towards the end of the frame. The last two steps share what is left, so that none is
  /// tiny.
  ParticleStepReport<NewtonReport> step_of_grid(double end, Observer<P, S> const& observer) {
    double const left = end - time_;
    double longest = points_.longest_step.value_or(left);
    if (particles_.count < std::ssize(start_.list) && source_speed_ * longest > reach()) {
      longest = reach() / source_speed_;
    }
    // What round-off has added to the frame is no step of its own.
    double h = stepper_.cfl_step(particles_, points_.spacing,
                                 left <= longest * (1 + 1e-9) ? left : longest, boundaries_, time_);
    if (points_.time_error && next_ > 0) h = std::min(h, next_);
    if (h < left && 2 * h > left) h = left / 2;
    if (!points_.time_error) return try_step(h, observer);
    std::vector<Particle> const before = particles_.read();
    for (int refused = 0;; ++refused) {
      auto report = try_step(h, observer);
      double const error = error_of(report.time_step), asked = *points_.time_error;
      // It is of second order.
      next_ = report.time_step * std::clamp(0.9 * std::sqrt(asked / error), 0.2, 2.0);
      report.halvings += refused;
      if (error <= asked) return report;
      take_back(before);
      if (refused == points_.halvings) {
        throw Error(
            "step {} at {:.6g} s: a step of {:.3g} s is off by {:.3g} m, more than grid.time_error "
            "asks for, and was shortened {} times: allow a larger error, or more halvings",
            steps_ + 1, time_, report.time_step, error, refused);
      }
      h = next_;
    }
  }
  /// m, how far the fastest goes in a step.
  double reach() const { return points_.cfl * points_.spacing; }

  ParticleStepReport<NewtonReport> try_step(double h, Observer<P, S> const& observer) {
    try {
      return stepper_.step(potential_, grid_, particles_, h, boundaries_, time_, observer);
    } catch (Error const& error) {
      throw Error("step {} at {:.6g} s: {}. {}", steps_ + 1, time_, error.what(), fastest_one());
    }
  }
  /// How far the end of a step is from where its forces, as they change over it, would have led:
  /// implicit Euler takes those at the end for all of it. Mass-weighted, m.
  double error_of(double h) {
    reducer_.provide(grid_.size(), 2);
    auto const& nodes = stepper_.nodes();
    auto const sums = reducer_.sum<2>(
        "gained", grid_.size(),
        Gained<S, P>{grid_.velocity(), nodes.v, grid_.unknowns().mass, grid_.unknowns().fixed});
    return sums[1] > 0 ? 0.5 * h * std::sqrt(sums[0] / sums[1]) : 0;
  }
  void take_back(std::vector<Particle> const& before) {
    std::vector<Particle> list = start_.list;
    std::copy(before.begin(), before.end(), list.begin());
    particles_ = Particles<P, S>(list);
    particles_.count = static_cast<int>(before.size());
  }
  /// A sentence about the particle that something is most likely wrong with.
  std::string fastest_one() const {
    std::vector<Particle> const list = particles_.read();
    auto const worse = [](Particle const& a, Particle const& b) {
      double const speed = norm(b.v);
      return !std::isfinite(speed) || norm(a.v) < speed;
    };
    auto const p = std::max_element(list.begin(), list.end(), worse);
    auto const object = static_cast<std::size_t>(p->object);
    return fmt::format(
        "The fastest is particle {} of {}, at ({:.4g}, {:.4g}, {:.4g}) m with {:.3g} "
        "m/s",
        p - list.begin(),
        object < points_.bodies.size() ? points_.bodies[object].name
                                       : points_.sources[object - points_.bodies.size()].name,
        p->x[0], p->x[1], p->x[2], norm(p->v));
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
    for (TriangleMesh const& drawing : start_.drawings) points += drawing.points.size();
    return points;
  }

  Scene scene_;
  ParticleScene points_;
  SceneParticles start_;
  Particles<P, S> particles_;              ///< all there will ever be; `count` of them are there
  Kokkos::View<double*, S::memory> born_;  ///< s
  ProgramGrid grid_;
  ParticlePotential potential_;
  BoundaryList<S> boundaries_;
  Stepper stepper_;
  ParticleFrame frame_;
  double source_speed_ = 0;  ///< of what comes out of sources, the largest, m/s
  double next_ = 0;          ///< s, the step that points_.time_error asks for; 0: not known yet
  Reducer<S> reducer_;
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
