#include <taut/apps/program/obstacle_terms_impl.hpp>

namespace taut {

template std::shared_ptr<ProgramObstacle<Fp64> const> add_obstacle_term(AnySteppedTerms<Fp64>&,
                                                                        ContactPart<Fp64> const&,
                                                                        ContactOptions const&,
                                                                        SceneObstacle const&);

}  // namespace taut
