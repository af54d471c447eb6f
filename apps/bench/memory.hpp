// What the solver takes of memory: Kokkos reports every array, the system the growth of the
// process.
#pragma once

namespace taut {

/// Watches from its construction on. One at a time.
class MemoryWatch {
public:
  MemoryWatch();
  ~MemoryWatch();
  MemoryWatch(MemoryWatch const&) = delete;
  MemoryWatch& operator=(MemoryWatch const&) = delete;

  double held() const;  ///< bytes in arrays of Kokkos, at most so far, beyond those at the start
  double held_now() const;  ///< the same at present
  double resident()
      const;  ///< bytes that the process has grown by; 0 where the system does not say
  static long allocations();  ///< arrays made so far, by anyone

private:
  double resident_before_;
};

}  // namespace taut
