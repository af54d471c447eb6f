// The minimisers of the program, by name. A name stands for a composition of policies; the keys of
// [solver] change its parts.
#pragma once

#include <taut/apps/program/any_policies.hpp>
#include <taut/apps/program/elastic_terms.hpp>
#include <taut/apps/program/method_title.hpp>
#include <taut/apps/program/scene_options.hpp>
#include <taut/core/potential/potential.hpp>
#include <taut/integrators/newton.hpp>
#include <taut/integrators/time_stepper.hpp>

#include <memory>
#include <span>

namespace taut {

template <class P>
using ProgramPotential =
    Potential<Inertia<P>, BodyForce<P>, ProgramTerms<P>, AnySteppedTerms<P, DefaultSpace>>;

/// All methods, in the order in which they are listed and drawn.
std::span<MethodTitle const> method_titles();

/// Throws Error for options that are of material points alone.
void require_of_meshes(SolverOptions const& options);

/// A minimiser of the program's potential that was chosen by name.
template <class P>
class AnyMinimiser {
public:
  using Precision = P;
  using Space = DefaultSpace;
  using Positions = VectorField<typename P::position, Space>;
  using Params = SolverOptions;

  /// Throws Error for a combination of options that does not exist.
  explicit AnyMinimiser(SolverOptions const& options);

  NewtonReport minimise(ProgramPotential<P>& potential, Positions const& x,
                        Observer<P, Space> const& observer) {
    return minimiser_->minimise(potential, x, observer);
  }

  struct Interface {
    virtual ~Interface() = default;
    virtual NewtonReport minimise(ProgramPotential<P>&, Positions const&,
                                  Observer<P, Space> const&) = 0;
  };

private:
  std::unique_ptr<Interface> minimiser_;
};

extern template class AnyMinimiser<Fp64>;
extern template class AnyMinimiser<Mixed>;
extern template class AnyMinimiser<Fp32>;

}  // namespace taut
