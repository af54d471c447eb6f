#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/host_loop.hpp>
#include <taut/core/report/error.hpp>

#include <algorithm>
#include <cstdint>
#include <cstring>

namespace taut::kernels {
namespace {

using Host = Kokkos::DefaultHostExecutionSpace;

// What a thread copies at least: less does not pay for waking it.
constexpr std::size_t chunk = std::size_t(1) << 17;

struct CopyChunks {
  std::byte* to;
  std::byte const* from;
  std::size_t bytes;
  void operator()(int c) const {
    std::size_t const first = chunk * c;
    std::memcpy(to + first, from + first, std::min(chunk, bytes - first));
  }
};

template <class T>
void fill(void* to, void const* value, std::size_t count) {
  T of;
  std::memcpy(&of, value, sizeof(T));
  std::fill_n(static_cast<T*>(to), count, of);
}

}  // namespace

void copy_bytes(void* to, void const* from, std::size_t bytes) {
  if (bytes == 0 || to == from) return;
  if (bytes < 2 * chunk) {
    std::memcpy(to, from, bytes);
    return;
  }
  static std::string const label = "copy";
  CopyChunks const chunks{static_cast<std::byte*>(to), static_cast<std::byte const*>(from), bytes};
  int const count = static_cast<int>(bytes / chunk + (bytes % chunk > 0));
  host_loop(Space<Host>::instance(), label, count, run_range<CopyChunks>, &chunks);
}

void fill_bytes(void* to, void const* value, std::size_t size, std::size_t count) {
  switch (size) {
    case 1:
      return fill<std::uint8_t>(to, value, count);
    case 4:
      return fill<std::uint32_t>(to, value, count);
    default:
      return fill<std::uint64_t>(to, value, count);
  }
}

void refuse_extents(std::string const& to, std::size_t extent_of_to, std::string const& from,
                    std::size_t extent_of_from) {
  throw Error("array {} has {} entries where {}, copied to it, has {}", to, extent_of_to, from,
              extent_of_from);
}

}  // namespace taut::kernels
