#include <taut/apps/program/bench_contact_impl.hpp>

namespace taut {
template void measure_contact_scene<Fp32>(ContactScene const&, ContactBenchOptions const&,
                                          MachineRates const&, std::vector<ContactRow>&);
}  // namespace taut
