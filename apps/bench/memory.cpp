#include <taut/apps/bench/memory.hpp>

#include <Kokkos_Core.hpp>
#include <impl/Kokkos_Profiling.hpp>

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>

namespace taut {
namespace {

std::atomic<long> count = 0, held_at_present = 0, held_most = 0;

void allocated(Kokkos_Profiling_SpaceHandle, char const*, void const*, std::uint64_t bytes) {
  ++count;
  held_at_present += static_cast<long>(bytes);
  held_most = std::max(held_most.load(), held_at_present.load());
}

void deallocated(Kokkos_Profiling_SpaceHandle, char const*, void const*, std::uint64_t bytes) {
  held_at_present -= static_cast<long>(bytes);
}

double resident_bytes() {
  long pages = 0, resident = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%ld %ld", &pages, &resident) != 2) resident = 0;
    std::fclose(file);
  }
  return double(resident) * double(sysconf(_SC_PAGESIZE));
}

}  // namespace

MemoryWatch::MemoryWatch() {
  malloc_trim(0);  // what is free already must not count as room
  count = held_at_present = held_most = 0;
  resident_before_ = resident_bytes();
  Kokkos::Tools::Experimental::set_allocate_data_callback(allocated);
  Kokkos::Tools::Experimental::set_deallocate_data_callback(deallocated);
}

MemoryWatch::~MemoryWatch() {
  Kokkos::Tools::Experimental::set_allocate_data_callback(nullptr);
  Kokkos::Tools::Experimental::set_deallocate_data_callback(nullptr);
}

double MemoryWatch::held() const { return double(held_most); }
double MemoryWatch::held_now() const { return double(held_at_present); }
double MemoryWatch::resident() const {
  malloc_trim(0);
  return resident_bytes() - resident_before_;
}
long MemoryWatch::allocations() { return count; }

}  // namespace taut
