// The same answer bit for bit: for 1 and 2 threads, in serial, for both layouts, and run after run.
#include "toy_objectives.hpp"

#include <support/threads.hpp>
#include <taut/integrators/lbfgs.hpp>
#include <taut/integrators/ncg.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <vector>

using namespace taut;

namespace {

// More unknowns than one run of a sum, so that threads share the work.
constexpr toy::ChainParams long_chain{.size = 3000};

/// All positions after 25 iterations.
template <class Method>
std::vector<double> result() {
  toy::Chain<toy::Barrier, typename Method::Precision, typename Method::Space> chain(long_chain);
  auto const x = chain.start();
  typename Method::Params method;
  method.stop.tolerance = 0;
  method.budget.max_iterations = 25;
  Method(method).minimise(chain, x);
  auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), x);
  std::vector<double> values;
  for (int i = 0; i < long_chain.size; ++i)
    for (int c = 0; c < 3; ++c) values.push_back(double(host(i, c)));
  return values;
}

template <class S, class P = Mixed>
using Conjugate = Ncg<DaiKou, BlockJacobi, SufficientDecrease, DecrementWindow, P, S>;
template <class S, class P = Mixed>
using Memory = Lbfgs<BlockJacobi, SufficientDecrease, DecrementWindow, P, S>;

using Right = Space<Kokkos::Serial, Kokkos::LayoutRight>;
using Left = Space<Kokkos::Serial, Kokkos::LayoutLeft>;

}  // namespace

TEST_CASE("runs repeat bitwise, for any number of threads") {
  auto const conjugate = result<Conjugate<DefaultSpace>>();
  CHECK(result<Conjugate<DefaultSpace>>() == conjugate);
  auto const memory = result<Memory<DefaultSpace>>();
  test::on_one_thread([&] {
    CHECK(result<Conjugate<DefaultSpace>>() == conjugate);
    CHECK(result<Memory<DefaultSpace>>() == memory);
  });
  // A device contracts products and sums otherwise.
  if constexpr (DefaultSpace::on_host) {
    CHECK(result<Conjugate<Right>>() == conjugate);
    CHECK(result<Memory<Right>>() == memory);
  }
}

TEST_CASE("both layouts give the same") {
  // Not to the last bit: the compiler contracts products and sums as the layout lets it vectorise.
  auto const distance = [](std::vector<double> const& a, std::vector<double> const& b) {
    double largest = 0;
    for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::abs(a[k] - b[k]));
    return largest;
  };
  CHECK(distance(result<Conjugate<Left, Fp64>>(), result<Conjugate<Right, Fp64>>()) < 1e-9);
  CHECK(distance(result<Memory<Left, Fp64>>(), result<Memory<Right, Fp64>>()) < 1e-9);
}
