#include <taut/apps/program/particle_simulation.hpp>

namespace taut {

static bool const filled = write_grid_late.fill(write_grid);

}  // namespace taut
