// The device kernels of the contact search, instantiated once: compiled where there is an nvcc, run
// nowhere.
#include <taut/contact/bvh.hpp>
#include <taut/contact/candidate_cache.hpp>
#include <taut/contact/spatial_hash.hpp>

using namespace taut;

using S = DefaultSpace;
template class taut::SpatialHash<S>;
template class taut::Bvh<S>;
template class taut::BruteForce<S>;
template class taut::CandidateCache<SpatialHash<S>, Mixed>;
template class taut::CandidateCache<Bvh<S>, Fp64>;
template class taut::CandidateCache<BruteForce<S>, Fp32>;

void all_filters(Candidates<S>& candidates, RestExclusion<S> const& exclusion,
                 VectorField<double, S> const& x) {
  candidates.keep(CloserThan<float>{1}, x);
  candidates.keep(exclusion, x);
}
