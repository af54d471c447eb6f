#include <taut/apps/program/particle_terms.hpp>

namespace taut {

static bool const filled = add_solid_late<Arap>.fill(add_solid<Arap>);

}  // namespace taut
