#include <taut/apps/variants/elastic_filters.hpp>

namespace taut {

static bool const filled =
    add_filtered_term<NeoHookean>.fill(add_filtered<NeoHookean>) &&
    add_filtered_term<StableNeoHookean>.fill(add_filtered<StableNeoHookean>) &&
    add_filtered_term<StableNeoHookean2018>.fill(add_filtered<StableNeoHookean2018>);

}  // namespace taut
