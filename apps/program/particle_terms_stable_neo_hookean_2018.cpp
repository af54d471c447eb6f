#include <taut/apps/program/particle_terms_impl.hpp>

namespace taut {

template void add_solid<StableNeoHookean2018>(ParticleTerms&, std::vector<Lame<double>> const&);

}  // namespace taut
