#include <taut/apps/program/contact_terms_impl.hpp>

namespace taut {

template std::shared_ptr<ProgramContact<Mixed> const> add_contact_term(AnySteppedTerms<Mixed>&,
                                                                       ContactPart<Mixed> const&,
                                                                       ContactOptions const&);

template std::shared_ptr<ProgramContact<Fp32> const> add_contact_term(AnySteppedTerms<Fp32>&,
                                                                      ContactPart<Fp32> const&,
                                                                      ContactOptions const&);

}  // namespace taut
