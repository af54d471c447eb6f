#include <taut/apps/program/obstacle_terms_impl.hpp>

namespace taut {

template std::shared_ptr<ProgramObstacle<Mixed> const> add_obstacle_term(AnySteppedTerms<Mixed>&,
                                                                         ContactPart<Mixed> const&,
                                                                         ContactOptions const&,
                                                                         SceneObstacle const&);

template std::shared_ptr<ProgramObstacle<Fp32> const> add_obstacle_term(AnySteppedTerms<Fp32>&,
                                                                        ContactPart<Fp32> const&,
                                                                        ContactOptions const&,
                                                                        SceneObstacle const&);

}  // namespace taut
