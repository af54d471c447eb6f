#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<FixedCorotated>, Fp64>;

}  // namespace taut
