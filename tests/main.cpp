// The main of every test executable: Kokkos lives exactly as long as the Catch2 session.

#include <Kokkos_Core.hpp>
#include <catch2/catch_session.hpp>

int main(int argc, char* argv[]) {
  // Catch2 reads every argument; Kokkos is set through its environment variables.
  const Kokkos::ScopeGuard kokkos;
  return Catch::Session().run(argc, argv);
}
