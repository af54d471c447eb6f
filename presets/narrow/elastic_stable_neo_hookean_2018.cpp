#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<StableNeoHookean2018>, Mixed>;
template class ElasticTets<Elastic<StableNeoHookean2018>, Fp32>;

}  // namespace taut
