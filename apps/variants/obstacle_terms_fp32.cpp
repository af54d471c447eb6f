#include <taut/apps/program/obstacle_terms_impl.hpp>

namespace taut {

template std::shared_ptr<ProgramObstacle<Fp32> const> add_obstacle_term(AnySteppedTerms<Fp32>&,
                                                                        ContactPart<Fp32> const&,
                                                                        ContactOptions const&,
                                                                        SceneObstacle const&);

}  // namespace taut
