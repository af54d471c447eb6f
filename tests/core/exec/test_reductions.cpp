// Sums, maxima and minima against plain loops; sums bitwise on any number of threads.
#include <support/threads.hpp>
#include <taut/core/exec/parallel.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

using namespace taut;
using Catch::Matchers::ContainsSubstring;

namespace {

using S = DefaultSpace;
using Values = Kokkos::View<double*, S::memory>;

// Around the length of a run, of a run of runs, and nothing.
constexpr int counts[] = {0, 1, 511, 512, 513, 512 * 512 + 1};

/// Term k of iteration i: `value(i)` shifted, so that the K sums differ.
template <int K>
struct AddTerms {
  Values value;
  KOKKOS_FUNCTION void operator()(int i, Sums<double, K>& sums) const {
    for (int k = 0; k < K; ++k) sums[k] += (k + 1) * value(i) + k;
  }
};

struct AddFloat {
  Values value;
  KOKKOS_FUNCTION void operator()(int i, Sums<float, 1>& sums) const {
    sums[0] += static_cast<float>(value(i));
  }
};

struct RaiseTo {
  Values value;
  KOKKOS_FUNCTION void operator()(int i, double& largest) const {
    largest = Kokkos::max(largest, value(i));
  }
};

struct LowerTo {
  Values value;
  KOKKOS_FUNCTION void operator()(int i, double& smallest) const {
    smallest = Kokkos::min(smallest, value(i));
  }
};

/// Leaves partial sums as a kernel does that sums by itself.
template <int K>
struct LeavePartials {
  Values value, partial;
  KOKKOS_FUNCTION void operator()(int r) const {
    Sums<double, K> sums;
    AddTerms<K>{value}(r, sums);
    for (int k = 0; k < K; ++k) partial(K * r + k) = sums[k];
  }
};

struct Sample {
  std::vector<double> host;
  Values device;
  explicit Sample(int n) : host(n), device("values", n) {
    std::mt19937 random(n);
    std::uniform_real_distribution<double> uniform(-1, 2);
    for (double& v : host) v = uniform(random);
    assign(device, Kokkos::View<double const*, Kokkos::HostSpace, Kokkos::MemoryUnmanaged>(
                       host.data(), host.size()));
  }
  /// What a sum is to be, and how far round-off may take it: log2(n) + 512 additions at most follow
  /// each term.
  template <int K>
  void check(Sums<double, K> const& sums) const {
    for (int k = 0; k < K; ++k) {
      long double sum = 0, size = 0;
      for (double v : host) {
        sum += (k + 1) * static_cast<long double>(v) + k;
        size += std::abs((k + 1) * v + k);
      }
      INFO("n = " << host.size() << ", sum " << k << " of " << K);
      CHECK(std::abs(sums[k] - sum) <= 600 * std::numeric_limits<double>::epsilon() * size);
    }
  }
};

template <int K>
std::vector<double> numbers(Sums<double, K> const& sums) {
  return {sums.value, sums.value + K};
}

template <int K>
void check_sums() {
  for (int n : counts) {
    Sample const sample(n);
    Reducer<S> const reducer(n, K);
    auto const sum = [&] {
      return numbers(reducer.sum<K>("test_sum", n, AddTerms<K>{sample.device}));
    };
    sample.check(reducer.sum<K>("test_sum", n, AddTerms<K>{sample.device}));
    auto const results = test::on_one_thread_and_all(sum);
    CHECK(results[0] == results[1]);
    CHECK(results[0] == sum());
  }
}

}  // namespace

TEST_CASE("sums are those of plain loops, bitwise for any number of threads", "[exec]") {
  check_sums<1>();
  check_sums<2>();
  check_sums<3>();
  check_sums<4>();
  check_sums<5>();
  check_sums<6>();
  check_sums<7>();
  check_sums<8>();
}

TEST_CASE("sums in single precision", "[exec]") {
  int const n = 512 * 512 + 1;
  Sample const sample(n);
  double sum = 0;
  for (double v : sample.host) sum += v;
  float const found = Reducer<S, float>(n).sum<1>("test_sum", n, AddFloat{sample.device})[0];
  CHECK(std::abs(found - sum) < 1e-6 * sum);
}

TEST_CASE("a reducer finishes what kernels have summed", "[exec]") {
  for (int count : counts) {
    Sample const sample(count);
    auto const reducer = Reducer<S>::of_partials(count, 3);
    auto const finish = [&] {
      for_each<S>("test_partials", count, LeavePartials<3>{sample.device, reducer.partials()});
      return numbers(reducer.finish<3>("test_finish", count));
    };
    for_each<S>("test_partials", count, LeavePartials<3>{sample.device, reducer.partials()});
    sample.check(reducer.finish<3>("test_finish", count));
    auto const results = test::on_one_thread_and_all(finish);
    CHECK(results[0] == results[1]);
  }
}

TEST_CASE("a reducer refuses more than its memory holds", "[exec]") {
  Sample const sample(1000);
  Reducer<S> const reducer(999, 2);
  CHECK_THROWS_WITH(reducer.sum<1>("too_long", 1000, AddTerms<1>{sample.device}),
                    ContainsSubstring("too_long") && ContainsSubstring("1000"));
  CHECK_THROWS_WITH(reducer.sum<3>("too_wide", 10, AddTerms<3>{sample.device}),
                    ContainsSubstring("too_wide"));
  CHECK_THROWS_AS(reducer.finish<1>("too_many", 513), Error);
  CHECK_THROWS_AS(Reducer<S>().sum<1>("empty", 1, AddTerms<1>{sample.device}), Error);
}

TEST_CASE("sums in any order are the same to round-off", "[exec]") {
  for (int n : counts) {
    Sample const sample(n);
    sample.check(FreeReducer<S>(n).sum<4>("test_free", n, AddTerms<4>{sample.device}));
  }
}

TEST_CASE("maxima and minima, also of nothing", "[exec]") {
  for (int n : counts) {
    Sample const sample(n);
    double largest = -5, smallest = 5;
    for (double v : sample.host) {
      largest = std::max(largest, v);
      smallest = std::min(smallest, v);
    }
    CHECK(maximum<S>("test_max", n, -5.0, RaiseTo{sample.device}) == largest);
    CHECK(minimum<S>("test_min", n, 5.0, LowerTo{sample.device}) == smallest);
    // Never beyond the bound.
    CHECK(maximum<S>("test_max", n, 7.0, RaiseTo{sample.device}) == 7);
    CHECK(minimum<S>("test_min", n, -7.0, LowerTo{sample.device}) == -7);
  }
}

TEST_CASE("a loop's label is kept", "[exec]") {
  std::string const& first = label("a name of more than fifteen characters");
  CHECK(first == "a name of more than fifteen characters");
  CHECK(&label(std::string("a name of more than fifteen ") + "characters") == &first);
  CHECK(&label("another") != &first);
}
