// The minimisers of the program for material points, by name: those of meshes (methods.hpp) over
// the nodes of a grid, where a multigrid cycle is one more preconditioner.
#pragma once

#include <taut/apps/program/method_title.hpp>
#include <taut/apps/program/particle_potential.hpp>
#include <taut/apps/program/scene_options.hpp>
#include <taut/integrators/newton.hpp>

#include <memory>
#include <span>

namespace taut {

/// A minimiser of the potential of particles that was chosen by name.
class ParticleMinimiser {
public:
  using Precision = ParticlePrecision;
  using Space = DefaultSpace;
  using Positions = VectorField<Precision::position, Space>;
  using Params = SolverOptions;

  /// Throws Error for a combination of options that does not exist.
  explicit ParticleMinimiser(Params const& options);

  NewtonReport minimise(ParticlePotential& potential, Positions const& x,
                        Observer<Precision, Space> const& observer) {
    return minimiser_->minimise(potential, x, observer);
  }

  struct Interface {
    virtual ~Interface() = default;
    virtual NewtonReport minimise(ParticlePotential&, Positions const&,
                                  Observer<Precision, Space> const&) = 0;
  };

private:
  std::unique_ptr<Interface> minimiser_;
};

/// The compositions that only scenes of particles have, and their default, in the order in which
/// they are listed; they take nonlinear CG and newton besides (method_titles).
std::span<MethodTitle const> particle_method_titles();

/// The preconditioner that a scene of particles takes: never "auto".
std::string particle_preconditioner(SolverOptions const& options);
/// Whether its cycle can be a strong one (solver.strong_cycle).
bool has_strong_cycle(SolverOptions const& options);
/// Throws Error for a key that [solver] says and that changes nothing of material points with this
/// method.
void refuse_without_effect(Section const& solver, SolverOptions const& options);

}  // namespace taut
