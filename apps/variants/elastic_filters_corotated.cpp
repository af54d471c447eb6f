#include <taut/apps/variants/elastic_filters.hpp>

namespace taut {

static bool const filled = add_filtered_term<Arap>.fill(add_filtered<Arap>) &&
                           add_filtered_term<FixedCorotated>.fill(add_filtered<FixedCorotated>);

}  // namespace taut
