#include <taut/presets/elastic.hpp>

namespace taut {

template class ElasticTets<Elastic<Arap>, Mixed>;
template class ElasticTets<Elastic<Arap>, Fp32>;

}  // namespace taut
