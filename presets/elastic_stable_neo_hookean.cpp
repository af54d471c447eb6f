#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<StableNeoHookean>, Fp64>;

}  // namespace taut
