#include <taut/apps/program/particle_terms.hpp>

namespace taut {

static bool const filled = add_solid_late<StableNeoHookean>.fill(add_solid<StableNeoHookean>);

}  // namespace taut
