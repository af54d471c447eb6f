#include <taut/apps/program/obstacle_terms_impl.hpp>

namespace taut {

template std::shared_ptr<ProgramObstacle<Mixed> const> add_obstacle_term(AnySteppedTerms<Mixed>&,
                                                                         ContactPart<Mixed> const&,
                                                                         ContactOptions const&,
                                                                         SceneObstacle const&);

}  // namespace taut
