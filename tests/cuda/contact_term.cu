// The kernels of the contact term, instantiated once (see all_kernels.cu).
#include <taut/contact/contact.hpp>
#include <taut/contact/spatial_hash.hpp>
#include <taut/core/potential/potential.hpp>

using namespace taut;

template class taut::Contact<>;
template class taut::Contact<PairEnergy<LogBarrier, TruncatedCurvature, NoMollifier>,
                             Bvh<DefaultSpace>, PairwiseClosing, ElasticInclusiveStiffness, Fp64>;
template class taut::Contact<PairEnergy<Normalised<IpcBarrier>, ExactCurvature>,
                             SpatialHash<DefaultSpace>, AdditiveCcd, GivenStiffness, Fp32>;

/// The potential's kernels for terms that are told when a step begins.
Potential<Inertia<>, Contact<>> begin(Unknowns<> const& unknowns, Contact<> const& contact,
                                      VectorField<double, DefaultSpace> const& x) {
  Potential<Inertia<>, Contact<>> potential(unknowns, Inertia<>(unknowns), contact);
  potential.begin_step(x, 1e-4, 0.01, true);
  return potential;
}
