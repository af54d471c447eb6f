#include <taut/apps/program/elastic_terms_impl.hpp>

namespace taut {

template void add_elastic_term<FixedCorotated, Fp64>(ProgramTerms<Fp64>&, ElasticPart const&,
                                                     std::string_view);
template void add_elastic_term<FixedCorotated, Mixed>(ProgramTerms<Mixed>&, ElasticPart const&,
                                                      std::string_view);
template void add_elastic_term<FixedCorotated, Fp32>(ProgramTerms<Fp32>&, ElasticPart const&,
                                                     std::string_view);

}  // namespace taut
