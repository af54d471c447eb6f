// Counts what the whole executable takes from the heap: for tests that say that nothing does.
// Include it in one source of an executable alone, for it replaces the global operators.
#pragma once

#include <atomic>
#include <cstdlib>
#include <new>

namespace taut::test {

inline std::atomic<long> heap_allocations{0};

}  // namespace taut::test

// Not inlined: compilers take malloc here and delete there for a mismatch. All forms of `new` for
// single objects, or a sanitizer sees one of its own freed by one of these.
[[gnu::noinline]] void* operator new(std::size_t size, std::nothrow_t const&) noexcept {
  ++taut::test::heap_allocations;
  return std::malloc(size > 0 ? size : 1);
}
[[gnu::noinline]] void* operator new(std::size_t size) {
  if (void* const memory = operator new(size, std::nothrow)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
