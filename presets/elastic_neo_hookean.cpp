#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<NeoHookean>, Fp64>;

}  // namespace taut
