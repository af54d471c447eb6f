#include <taut/apps/bench/contact_impl.hpp>

namespace taut {
template void measure_contact_scene<Fp64>(ContactScene const&, ContactBenchOptions const&,
                                          MachineRates const&, std::vector<ContactRow>&);
template void measure_contact_scene<Mixed>(ContactScene const&, ContactBenchOptions const&,
                                           MachineRates const&, std::vector<ContactRow>&);
}  // namespace taut
