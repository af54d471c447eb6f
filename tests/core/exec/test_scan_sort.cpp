// Scans and stable sorts against plain loops and the standard library. Their results are unique, so
// equality with a serial loop also says that they repeat bitwise.
#include <support/threads.hpp>
#include <taut/core/exec/buckets.hpp>
#include <taut/core/exec/sort.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

using namespace taut;
using Catch::Matchers::ContainsSubstring;

namespace {

using S = DefaultSpace;
template <class T>
using View = Kokkos::View<T*, S::memory>;

constexpr int lengths[] = {0, 1, 511, 512, 513, 4096, 4097, 100'000};

template <class T>
View<T> to_device(std::vector<T> const& from) {
  View<T> to("test", from.size());
  assign(to, Kokkos::View<T const*, Kokkos::HostSpace, Kokkos::MemoryUnmanaged>(from.data(),
                                                                                from.size()));
  return to;
}

template <class T>
std::vector<T> to_host(View<T> const& from) {
  auto const host = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), from);
  return {host.data(), host.data() + host.extent(0)};
}

struct Odd {
  KOKKOS_FUNCTION int operator()(int i) const { return i % 2; }
};

/// Ways to draw a key.
template <class Key>
std::vector<Key> keys(int n, int kind) {
  std::mt19937_64 random(n + kind);
  std::vector<Key> all(n);
  for (int k = 0; k < n; ++k) {
    switch (kind) {
      case 0:  // all bits
        all[k] = static_cast<Key>(random());
        break;
      case 1:  // many duplicates
        all[k] = static_cast<Key>(random() % 7);
        break;
      case 2:  // one value
        all[k] = 0;
        break;
      case 3:  // descending over two digits, with the largest of all
        all[k] = k == n / 2 ? std::numeric_limits<Key>::max() : static_cast<Key>(3 * (n - k));
        break;
      default:  // in the second digit alone
        all[k] = static_cast<Key>(random() % 16) << 8;
    }
  }
  return all;
}

}  // namespace

TEST_CASE("an exclusive scan says where each part begins", "[exec]") {
  for (int n : lengths) {
    std::vector<int> lengths(n), expected(n);
    std::mt19937 random(n);
    for (int& length : lengths) length = static_cast<int>(random() % 10);
    std::exclusive_scan(lengths.begin(), lengths.end(), expected.begin(), 0);
    int const total = std::accumulate(lengths.begin(), lengths.end(), 0);
    auto const scan = [&] {
      View<int> const values = to_device(lengths);
      CHECK(exclusive_scan<S, int>("test_scan", values) == total);
      return to_host(values);
    };
    for (auto const& result : test::on_one_thread_and_all(scan)) CHECK(result == expected);

    // Over a functor, in a wider integer.
    View<std::int64_t> const begin("begin", n);
    CHECK(exclusive_scan<S, std::int64_t>("test_scan", n, Odd{}, begin) == n / 2);
    auto const host = to_host(begin);
    for (int k = 0; k < n; ++k) {
      if (host[k] != k / 2) FAIL("begin of " << k << " is " << host[k]);
    }
  }
}

TEMPLATE_TEST_CASE("sorts are stable", "[exec]", std::uint32_t, std::uint64_t) {
  using Key = TestType;
  StableSort<S, Key> const sorter(100'000);
  for (int n : lengths) {
    for (int kind = 0; kind < 5; ++kind) {
      std::vector<Key> const given = keys<Key>(n, kind);
      std::vector<int> expected(n);
      std::iota(expected.begin(), expected.end(), 0);
      std::stable_sort(expected.begin(), expected.end(),
                       [&](int a, int b) { return given[a] < given[b]; });
      std::vector<Key> sorted(n);
      for (int k = 0; k < n; ++k) sorted[k] = given[expected[k]];

      INFO("n = " << n << ", kind " << kind);
      auto const sort = [&] {
        View<Key> const key = to_device(given);
        View<int> const order("order", n);
        sorter.sort(n, key, order);
        CHECK((to_host(key) == sorted));
        return to_host(order);
      };
      for (auto const& order : test::on_one_thread_and_all(sort)) CHECK((order == expected));
    }
  }
}

TEST_CASE("a sort takes the first keys of a longer array, and not more than its memory", "[exec]") {
  StableSort<S> const sorter(3);
  View<std::uint32_t> const key = to_device<std::uint32_t>({9, 2, 5, 1});
  View<int> const order("order", 4);
  sorter.sort(3, key, order);
  CHECK(to_host(key) == std::vector<std::uint32_t>{2, 5, 9, 1});
  auto const found = to_host(order);
  CHECK(std::vector<int>(found.begin(), found.begin() + 3) == std::vector<int>{1, 2, 0});
  CHECK_THROWS_WITH(sorter.sort(4, key, order), ContainsSubstring("scratch memory for 3"));
}

TEST_CASE("buckets hold their items in ascending order", "[exec]") {
  BucketSort<S> const sorter(100'000);
  for (int n : lengths) {
    for (int buckets : {1, 2, 300, 70'000}) {
      // The first and the last buckets stay empty where there are enough.
      std::mt19937 random(n + buckets);
      std::vector<int> bucket(n);
      for (int& b : bucket) {
        b = buckets < 10 ? static_cast<int>(random() % buckets)
                         : 2 + static_cast<int>(random() % (buckets - 5));
      }
      std::vector<int> begin(buckets + 1, 0), order(n);
      for (int b : bucket) ++begin[b + 1];
      std::partial_sum(begin.begin(), begin.end(), begin.begin());
      std::iota(order.begin(), order.end(), 0);
      std::stable_sort(order.begin(), order.end(),
                       [&](int a, int b) { return bucket[a] < bucket[b]; });

      INFO("n = " << n << ", buckets " << buckets);
      View<int> const device = to_device(bucket);
      auto const sort = [&] {
        View<int> const b("begin", buckets + 1), o("order", n);
        sorter.sort(n, device, buckets, b, o);
        CHECK((to_host(b) == begin));
        return to_host(o);
      };
      for (auto const& result : test::on_one_thread_and_all(sort)) CHECK((result == order));

      Buckets const host = sort_into_buckets(bucket, buckets);
      CHECK((host.begin == begin));
      CHECK((host.item == order));
    }
  }
}

TEST_CASE("an item in no bucket is an error that names it", "[exec]") {
  BucketSort<S> const sorter(5);
  View<int> const begin("begin", 4), order("order", 5);
  for (int stray : {-1, 3}) {
    View<int> const bucket = to_device<int>({0, 2, 1, stray, stray});
    CHECK_THROWS_WITH(sorter.sort(5, bucket, 3, begin, order), ContainsSubstring("item 3"));
  }
}
