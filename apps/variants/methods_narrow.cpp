#include <taut/apps/program/methods_impl.hpp>

namespace taut {

template class AnyMinimiser<Mixed>;
template class AnyMinimiser<Fp32>;

}  // namespace taut
