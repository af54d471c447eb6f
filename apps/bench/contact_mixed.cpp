#include <taut/apps/bench/contact_impl.hpp>

namespace taut {
template void measure_contact_scene<Mixed>(ContactScene const&, ContactBenchOptions const&,
                                           MachineRates const&, std::vector<ContactRow>&);
}  // namespace taut
