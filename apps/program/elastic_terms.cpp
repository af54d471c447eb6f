#include <taut/apps/program/elastic_terms_impl.hpp>

namespace taut {

template void add_elastic_term<Arap, Fp64>(ProgramTerms<Fp64>&, ElasticPart const&,
                                           std::string_view);
template void add_elastic_term<FixedCorotated, Fp64>(ProgramTerms<Fp64>&, ElasticPart const&,
                                                     std::string_view);
template void add_elastic_term<NeoHookean, Fp64>(ProgramTerms<Fp64>&, ElasticPart const&,
                                                 std::string_view);
template void add_elastic_term<StableNeoHookean, Fp64>(ProgramTerms<Fp64>&, ElasticPart const&,
                                                       std::string_view);
template void add_elastic_term<StableNeoHookean2018, Fp64>(ProgramTerms<Fp64>&, ElasticPart const&,
                                                           std::string_view);

}  // namespace taut
