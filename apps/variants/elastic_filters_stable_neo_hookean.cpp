#include <taut/apps/variants/elastic_filters.hpp>

namespace taut {

static bool const filled = add_filtered_term<StableNeoHookean>.fill(add_filtered<StableNeoHookean>);

}  // namespace taut
