#include <taut/apps/variants/elastic_filters.hpp>

namespace taut {

static bool const filled =
    add_filtered_term<StableNeoHookean2018>.fill(add_filtered<StableNeoHookean2018>);

}  // namespace taut
