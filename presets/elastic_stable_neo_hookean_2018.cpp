#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<StableNeoHookean2018>, Fp64>;

}  // namespace taut
