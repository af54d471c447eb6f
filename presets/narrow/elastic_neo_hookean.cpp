#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<NeoHookean>, Mixed>;
template class ElasticTets<Elastic<NeoHookean>, Fp32>;

}  // namespace taut
