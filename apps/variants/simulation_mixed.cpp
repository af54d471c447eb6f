#include <taut/apps/program/simulation_impl.hpp>

namespace taut {

static bool const filled = simulation_in_mixed.fill(make_simulation<Mixed>);

}  // namespace taut
