#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<Arap>, Fp64>;

}  // namespace taut
