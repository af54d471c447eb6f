#include <taut/apps/variants/elastic_filters.hpp>

namespace taut {

static bool const filled = add_filtered_term<NeoHookean>.fill(add_filtered<NeoHookean>);

}  // namespace taut
