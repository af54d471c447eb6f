#include <taut/apps/program/contact_terms_impl.hpp>

namespace taut {

template std::shared_ptr<ProgramContact<Fp64> const> add_contact_term(AnySteppedTerms<Fp64>&,
                                                                      ContactPart<Fp64> const&,
                                                                      ContactOptions const&);

}  // namespace taut
