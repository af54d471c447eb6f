#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<FixedCorotated>, Mixed>;
template class ElasticTets<Elastic<FixedCorotated>, Fp32>;

}  // namespace taut
