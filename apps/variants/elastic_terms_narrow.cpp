#include <taut/apps/program/elastic_terms_impl.hpp>

namespace taut {

template void add_elastic_term<Arap, Mixed>(ProgramTerms<Mixed>&, ElasticPart const&,
                                            std::string_view);
template void add_elastic_term<FixedCorotated, Mixed>(ProgramTerms<Mixed>&, ElasticPart const&,
                                                      std::string_view);
template void add_elastic_term<NeoHookean, Mixed>(ProgramTerms<Mixed>&, ElasticPart const&,
                                                  std::string_view);
template void add_elastic_term<StableNeoHookean, Mixed>(ProgramTerms<Mixed>&, ElasticPart const&,
                                                        std::string_view);
template void add_elastic_term<StableNeoHookean2018, Mixed>(ProgramTerms<Mixed>&,
                                                            ElasticPart const&, std::string_view);

template void add_elastic_term<Arap, Fp32>(ProgramTerms<Fp32>&, ElasticPart const&,
                                           std::string_view);
template void add_elastic_term<FixedCorotated, Fp32>(ProgramTerms<Fp32>&, ElasticPart const&,
                                                     std::string_view);
template void add_elastic_term<NeoHookean, Fp32>(ProgramTerms<Fp32>&, ElasticPart const&,
                                                 std::string_view);
template void add_elastic_term<StableNeoHookean, Fp32>(ProgramTerms<Fp32>&, ElasticPart const&,
                                                       std::string_view);
template void add_elastic_term<StableNeoHookean2018, Fp32>(ProgramTerms<Fp32>&, ElasticPart const&,
                                                           std::string_view);

}  // namespace taut
