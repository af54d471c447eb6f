#include <taut/apps/program/particle_terms.hpp>

namespace taut {

static bool const filled = add_solid_late<NeoHookean>.fill(add_solid<NeoHookean>);

}  // namespace taut
