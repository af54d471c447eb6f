#include <taut/apps/program/particle_terms.hpp>

namespace taut {

static bool const filled =
    add_solid_late<Arap>.fill(add_solid<Arap>) &&
    add_solid_late<NeoHookean>.fill(add_solid<NeoHookean>) &&
    add_solid_late<StableNeoHookean>.fill(add_solid<StableNeoHookean>) &&
    add_solid_late<StableNeoHookean2018>.fill(add_solid<StableNeoHookean2018>);

}  // namespace taut
