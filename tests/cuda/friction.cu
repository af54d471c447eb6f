// The kernels of friction, instantiated once (see all_kernels.cu).
#include <taut/contact/contact.hpp>
#include <taut/contact/friction.hpp>

using namespace taut;

template class taut::Friction<>;
template class taut::Friction<Fp64>;
template class taut::Friction<Fp32>;

/// Contact as a source: instantiates its kernel.
void add_contact(Friction<>& friction, Contact<> const& contact) { friction.add(contact, 0.5); }
