#include <taut/apps/program/particle_terms.hpp>

namespace taut {

static bool const filled =
    add_solid_late<StableNeoHookean2018>.fill(add_solid<StableNeoHookean2018>);

}  // namespace taut
