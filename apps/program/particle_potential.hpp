// The incremental potential of a scene of material points. The terms over the particles are chosen
// by name, and made anew for the grid of every step (mpm/particle_stepper.hpp tells them).
#pragma once

#include <taut/core/fem/element_material.hpp>
#include <taut/core/potential/any_terms.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/core/report/error.hpp>
#include <taut/materials/elastic.hpp>
#include <taut/mpm/ghost_penalty.hpp>
#include <taut/mpm/material_range.hpp>
#include <taut/mpm/particle_grid.hpp>
#include <taut/mpm/particle_operator.hpp>
#include <taut/mpm/particle_split.hpp>
#include <taut/mpm/plastic_flow.hpp>
#include <taut/mpm/slip.hpp>

#include <functional>
#include <span>
#include <string_view>

namespace taut {

/// Particles are computed in fp64: they add up over all steps, and one precision compiles once.
using ParticlePrecision = Fp64;
using ParticleKernel = QuadraticSpline;
using ProgramGrid = ParticleGrid<ParticleKernel, ParticlePrecision, DefaultSpace>;

/// Terms over particles behind one type.
class ParticleTerms : public AnyTerms<ParticlePrecision, DefaultSpace> {
  using Base = AnyTerms<ParticlePrecision, DefaultSpace>;

public:
  using Points = Particles<ParticlePrecision, DefaultSpace>;
  using GridBlocks = ProgramGrid::Blocks;
  template <class T>
  using OperatorOf = ParticleOperator<ParticleKernel, T, DefaultSpace>;
  using Operator = OperatorOf<ParticlePrecision::real>;
  using Rounded = OperatorOf<float>;
  static_assert(!std::same_as<Operator, Rounded>, "linearise is then the same twice");
  using Split = SplitParticleState<ParticlePrecision::real, DefaultSpace>;
  using Numbers = Array<double, DefaultSpace>;

  /// The next materials are those of `term`.
  template <class Term>
  void add(Term term) {
    if (term.materials().first != materials_.end) {
      throw Error("a term over the materials from {} on, where {} is next", term.materials().first,
                  materials_.end);
    }
    materials_.end = term.materials().end;
    auto const held = Base::add(std::move(term));
    told_.push_back([held](Points const& particles, GridBlocks const& blocks,
                           GridNodes<DefaultSpace> const& grid,
                           Positions const& rest) { held->update(particles, blocks, grid, rest); });
    linearised_.push_back(
        {[held](Positions const& x, double scale, Operator& to) { held->linearise(x, scale, to); },
         [held](Positions const& x, double scale, Rounded& to) { held->linearise(x, scale, to); }});
    split_.push_back(
        {[held](Positions const& x, double stiffness, double scale, Split& state, Operator& to) {
           held->start_split(x, stiffness, scale, state, to);
         },
         [held](Positions const& x, double scale, double relaxation, bool first,
                FixedMask<DefaultSpace> const& fixed, Split const& state,
                Vectors const& g) { held->split(x, scale, relaxation, first, fixed, state, g); }});
    measured_.push_back([held](Numbers const& force, Numbers const& mass) {
      held->add_characteristic_force(force, mass);
    });
  }
  MaterialRange const& materials() const { return materials_; }
  Points const& particles() const { return particles_; }
  void update(Points const& particles, GridBlocks const& blocks,
              GridNodes<DefaultSpace> const& grid, Positions const& rest) {
    particles_ = particles;
    for (auto const& tell : told_) tell(particles, blocks, grid, rest);
  }

  /// For preconditioners that are made of particles.
  void linearise(Positions const& x, double scale, Operator& to) const {
    for (LinearTerm const& term : linearised_) term.write(x, scale, to);
  }
  void linearise(Positions const& x, double scale, Rounded& to) const {
    for (LinearTerm const& term : linearised_) term.write_rounded(x, scale, to);
  }
  /// For ADMM (mpm/particle_split.hpp).
  void start_split(Positions const& x, double stiffness, double scale, Split& state,
                   Operator& to) const {
    for (SplitTerm const& term : split_) term.start(x, stiffness, scale, state, to);
  }
  void split(Positions const& x, double scale, double relaxation, bool first,
             FixedMask<DefaultSpace> const& fixed, Split const& state, Vectors const& g) const {
    for (SplitTerm const& term : split_) term.update(x, scale, relaxation, first, fixed, state, g);
  }
  void add_characteristic_force(Numbers const& force, Numbers const& mass) const {
    for (auto const& add : measured_) add(force, mass);
  }

private:
  MaterialRange materials_;
  Points particles_;
  std::vector<std::function<void(Points const&, GridBlocks const&, GridNodes<DefaultSpace> const&,
                                 Positions const&)>>
      told_;
  struct LinearTerm {
    std::function<void(Positions const&, double, Operator&)> write;
    std::function<void(Positions const&, double, Rounded&)> write_rounded;
  };
  std::vector<LinearTerm> linearised_;
  struct SplitTerm {
    std::function<void(Positions const&, double, double, Split&, Operator&)> start;
    std::function<void(Positions const&, double, double, bool, FixedMask<DefaultSpace> const&,
                       Split const&, Vectors const&)>
        update;
  };
  std::vector<SplitTerm> split_;
  std::vector<std::function<void(Numbers const&, Numbers const&)>> measured_;
};

using ParticlePotential =
    Potential<Inertia<ParticlePrecision>, BodyForce<ParticlePrecision>, ParticleTerms,
              GhostPenalty<ParticleKernel, ParticlePrecision>, Slip<ParticlePrecision>>;

/// Whether this model lets a material yield within the step that flows so after it.
bool yields_in_step(std::string_view model, FlowKind kind);
/// Adds the elastic term of a model (particle_models) over the materials that come next, which may
/// yield in the step as their flow does after it.
void add_particle_term(ParticleTerms& terms, std::string_view model,
                       std::span<Lame<double> const> materials,
                       std::span<MaterialFlow const> flows);

}  // namespace taut
