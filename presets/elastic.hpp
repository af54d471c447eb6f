// Elastic bodies of the named models with the paper's curvature filter, in every precision. They
// are compiled in the library: whoever includes this instead of core/fem/elastic_tets.hpp and a
// model compiles no element kernel of theirs. Any other composition is instantiated by its user.
#pragma once

#include <taut/core/fem/elastic_tets.hpp>
#include <taut/materials/models.hpp>

namespace taut {

extern template class ElasticTets<Elastic<Arap>, Fp64>;
extern template class ElasticTets<Elastic<Arap>, Mixed>;
extern template class ElasticTets<Elastic<Arap>, Fp32>;
extern template class ElasticTets<Elastic<FixedCorotated>, Fp64>;
extern template class ElasticTets<Elastic<FixedCorotated>, Mixed>;
extern template class ElasticTets<Elastic<FixedCorotated>, Fp32>;
extern template class ElasticTets<Elastic<NeoHookean>, Fp64>;
extern template class ElasticTets<Elastic<NeoHookean>, Mixed>;
extern template class ElasticTets<Elastic<NeoHookean>, Fp32>;
extern template class ElasticTets<Elastic<StableNeoHookean>, Fp64>;
extern template class ElasticTets<Elastic<StableNeoHookean>, Mixed>;
extern template class ElasticTets<Elastic<StableNeoHookean>, Fp32>;
extern template class ElasticTets<Elastic<StableNeoHookean2018>, Fp64>;
extern template class ElasticTets<Elastic<StableNeoHookean2018>, Mixed>;
extern template class ElasticTets<Elastic<StableNeoHookean2018>, Fp32>;

}  // namespace taut
