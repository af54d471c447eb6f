#include <taut/apps/program/simulation_impl.hpp>

namespace taut {

static bool const filled = simulation_in_mixed.fill(make_simulation<Mixed>) &&
                           simulation_in_fp32.fill(make_simulation<Fp32>);

}  // namespace taut
