// The kernels of the contact term, instantiated once (see all_kernels.cu).
#include <taut/contact/bvh.hpp>
#include <taut/contact/contact.hpp>

using namespace taut;

template class taut::Contact<>;
template class taut::Contact<PairEnergy<LogBarrier, TruncatedCurvature, NoMollifier>,
                             Bvh<DefaultSpace>, PairwiseClosing, ElasticInclusiveStiffness, Fp64>;
template class taut::Contact<PairEnergy<Normalised<IpcBarrier>, ExactCurvature>,
                             SpatialHash<DefaultSpace>, AdditiveCcd, GivenStiffness, Fp32>;

/// Any term that couples vertices may stand for the elastic one.
Array<float, DefaultSpace> vertex_stiffness(Contact<> const& term, Unknowns<> const& unknowns,
                                            VectorField<double, DefaultSpace> const& x) {
  return InclusiveStiffness<>().at(term, unknowns, x, 0.01);
}
