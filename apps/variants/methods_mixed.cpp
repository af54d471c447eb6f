#include <taut/apps/program/methods_impl.hpp>

namespace taut {

template class AnyMinimiser<Mixed>;

}  // namespace taut
