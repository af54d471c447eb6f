#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<StableNeoHookean>, Mixed>;
template class ElasticTets<Elastic<StableNeoHookean>, Fp32>;

}  // namespace taut
