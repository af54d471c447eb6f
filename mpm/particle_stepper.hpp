// A step of the material point method, implicit Euler over the velocities of the nodes of a grid:
//
//   sort particles, make the grid, bring mass and momentum to it;
//   x = argmin 1/2 |x - (X + h v)|^2_M + h^2 (V_1(x) + ...),  a time step as meshes take it, from
//     the nodes at rest;
//   bring velocities back, F <- (I + grad (x - X)) F, return map, move the particles.
//
// (Jiang et al. 2016; Wang et al. 2020.) The grid is forgotten after the step. A step in which a
// particle would go farther than its bound, in which boundaries would fold what they hold, or that
// does not end in numbers, is taken back and tried with half the time.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/potential/obstruction.hpp>
#include <taut/mpm/material_range.hpp>
#include <taut/mpm/particle_grid.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace taut {

struct ParticleStepParams {
  double cfl = 0.6;       ///< cells that the fastest particle goes in a step of cfl_step()
  double crossing = 1;    ///< cells that a particle may go at most
  int max_halvings = 10;  ///< of a step, before it is given up
};

namespace kernels {

/// Seconds in which a boundary, by its largest speeds, goes at most `stride` metres through where
/// particles see it.
template <class S, class Scalar>
struct TimeToMeet {
  VectorField<Scalar, S> x;
  Kokkos::View<Boundary const*, typename S::memory> boundaries;
  int boundary;
  BoundarySpeed speed;
  double sight, stride;
  KOKKOS_FUNCTION void operator()(int p, double& least) const {
    Boundary const& b = boundaries(boundary);
    Vec3<double> const at{double(x(p, 0)), double(x(p, 1)), double(x(p, 2))};
    Vec3<double> normal;
    double const room = b.distance(at, normal) - sight;
    double const fast = speed.linear + speed.angular * norm(at - b.pose.translation);
    if (fast > 0) least = Kokkos::min(least, Kokkos::max(stride, room) / fast);
  }
};

}  // namespace kernels

/// What a step did: the minimiser's report, and the rest.
template <class Report>
struct ParticleStepReport {
  Report minimiser;
  double time_step = 0;  ///< taken, s
  int halvings = 0;      ///< of the step that was asked for
  int nodes = 0, patches = 0;
  /// What lags (LaggedTerm) would still change the step: the passes were not enough for it to
  /// settle.
  bool unsettled = false;
  double travel_cells = 0;  ///< bound of how far a particle went, cells
};

/// `Stepper` takes a time step of the nodes: TimeStepper over any minimiser.
template <class Stepper, Spline K = QuadraticSpline, Transfer T = Apic, Flow F = NoFlow>
class ParticleStepper {
  static_assert(!Stepper::multistep,
                "taut: particles are stepped by one-step rules (ImplicitEuler): their grid has no "
                "past");

public:
  using Precision = typename Stepper::Precision;
  using Space = typename Stepper::Space;
  using Positions = VectorField<typename Precision::position, Space>;
  using Grid = ParticleGrid<K, Precision, Space>;

  explicit ParticleStepper(Stepper stepper = Stepper(), ParticleStepParams const& params = {},
                           T const& transfer = {}, F const& flow = {})
      : stepper_(std::move(stepper)), params_(params), transfer_(transfer), flow_(flow) {
    if (!(params.cfl > 0) || !(params.crossing > 0) || params.max_halvings < 0) {
      throw Error(
          "particle stepper: cfl = {}, crossing = {}, max_halvings = {}; give cells above 0 "
          "and 0 or more halvings",
          params.cfl, params.crossing, params.max_halvings);
    }
  }

  /// Seconds in which the fastest particle goes `cfl` cells, at most `longest`. Where a particle is
  /// of no speed that is `longest`: the step says which it is.
  double cfl_step(Particles<Precision, Space> const& particles, double dx, double longest) const {
    double const speed = fastest(particles);
    if (!std::isfinite(speed)) return longest;
    return speed * longest > params_.cfl * dx ? params_.cfl * dx / speed : longest;
  }
  /// The same, in which no boundary that is near goes farther through what particles see, either:
  /// it would be past them before a node has felt it. A boundary that is far may come near. `time`:
  /// now, which becomes that of the boundaries if any moves.
  double cfl_step(Particles<Precision, Space> const& particles, double dx, double longest,
                  BoundaryList<Space>& boundaries, double time) const {
    double h = cfl_step(particles, dx, longest);
    double const stride = params_.cfl * dx;
    // Nodes that particles see along a diagonal, and where particles may go.
    double const sight = (0.5 * K::width * std::sqrt(3.0) + params_.crossing) * dx;
    bool placed = false;
    for (int k = 0; k < boundaries.count(); ++k) {
      BoundarySpeed const speed = boundaries.fastest(k, time, h);
      if (speed.linear == 0 && speed.angular == 0) continue;
      if (!placed) boundaries.set_time(time);
      placed = true;
      h = minimum<Space>("time_to_meet", particles.count, h,
                         kernels::TimeToMeet<Space, typename Precision::position>{
                             particles.x, boundaries.list(), k, speed, sight, stride});
    }
    return h;
  }

  /// Advances particles by h seconds, or by the part of it that the report says. `scene` is a
  /// Potential over grid.unknowns() with terms over particles; `boundaries` are where they are h
  /// seconds later than `time`. Throws Error if h is not above 0, if a particle is nowhere, or if
  /// no part of the step can be taken, and leaves the particles as they were. `observer`: of the
  /// minimiser, none or one.
  template <class Potential, class... Observer>
  auto step(Potential& scene, Grid& grid, Particles<Precision, Space> const& particles, double h,
            BoundaryList<Space>& boundaries, double time = 0, Observer const&... observer) {
    if (!(h > 0) || !std::isfinite(h)) throw Error("a step of {} s; give one above 0", h);
    grid.rebuild(particles, std::max(1, static_cast<int>(terms_of_materials(scene).size())));
    scene.resize(grid.unknowns());
    scene.for_each_term([&](auto& term) {
      if constexpr (requires {
                      term.update(particles, grid.blocks(), grid.nodes(), grid.rest());
                    }) {
        term.update(particles, grid.blocks(), grid.nodes(), grid.rest());
      }
    });

    using Report = decltype(stepper_.step(scene, state_, h));
    ParticleStepReport<Report> report;
    report.nodes = grid.size();
    report.patches = grid.blocks().views().patches;
    if (grid.size() == 0) {
      report.time_step = h;
      return report;
    }
    for (;; h /= 2, ++report.halvings) {
      // What lags is where the step begins again, not where the refused one ended.
      if (report.halvings > 0) {
        scene.for_each_term([&](auto& term) {
          using Term = std::decay_t<decltype(term)>;
          if constexpr (requires { term.particles(); } && LaggedTerm<Term>) term.relag(grid.rest());
        });
      }
      boundaries.set_time(time + h);
      grid.fix(boundaries, h);
      scene.for_each_term([&](auto& term) {
        if constexpr (requires { term.hold(grid.rest(), grid.unknowns(), boundaries, h); }) {
          term.hold(grid.rest(), grid.unknowns(), boundaries, h);
        }
      });
      start(grid);
      try {
        report.minimiser = stepper_.step(scene, state_, h, observer...);
      } catch (HeldUp const&) {  // boundaries go less far in half the time
        if (report.halvings >= params_.max_halvings) throw;
        continue;
      }
      bool const finite = report.minimiser.stop != decltype(report.minimiser.stop)::non_finite;
      double const allowed = params_.crossing * grid.dx();
      double travel = std::numeric_limits<double>::infinity();
      if (finite) travel = travelled(grid, particles, allowed);
      report.travel_cells = travel / grid.dx();
      if (travel <= allowed) break;
      if (report.halvings >= params_.max_halvings) {
        throw Error(
            "a step of particles was halved {} times, to {} s, and one would still go {} cells: "
            "{}; soften the impact, or allow more crossing",
            report.halvings, h, report.travel_cells,
            finite ? "it is pushed too hard" : "the minimisation ends in no numbers");
      }
    }
    report.time_step = h;
    // What is taken anew here nobody sees: the next step takes its own.
    report.unsettled = scene.relag(state_.x);
    grid.to_particles(particles, state_.x, state_.v, h, transfer_, flow_);
    Space::instance().fence("taut: particle step");
    return report;
  }
  template <class Potential>
  auto step(Potential& scene, Grid& grid, Particles<Precision, Space> const& particles, double h) {
    BoundaryList<Space> none;
    return step(scene, grid, particles, h, none);
  }

  Stepper& stepper() { return stepper_; }
  /// The nodes where the last step ended.
  typename Stepper::StateType const& nodes() const { return state_; }

private:
  /// The nodes at rest, with the velocities of the particles.
  void start(Grid const& grid) {
    int const n = grid.size();
    state_.x = memory_[0].resize("node_x", n);
    state_.v = memory_[1].resize("node_v", n);
    state_.x_last = memory_[2].resize("node_x_last", n);
    state_.v_last = memory_[3].resize("node_v_last", n);
    assign_on<Space>(state_.x, grid.rest());
    assign_on<Space>(state_.v, grid.velocity());
    state_.last_step = 0;
  }
  /// A bound of how far a particle goes: nodes tell soon; if one goes too far, particles are asked.
  double travelled(Grid const& grid, Particles<Precision, Space> const& particles,
                   double allowed) const {
    double const node = maximum<Space>(
        "node_travel", grid.size(), 0.0,
        kernels::NodeTravel<Space, typename Precision::position>{state_.x, grid.rest()});
    if (node <= allowed) return node;
    return farthest_travel<K>(particles, grid.blocks(), state_.x, grid.rest(), grid.dx());
  }

  Stepper stepper_;
  ParticleStepParams params_;
  T transfer_;
  F flow_;
  typename Stepper::StateType state_;
  Resizable<Positions> memory_[4];
};

}  // namespace taut
