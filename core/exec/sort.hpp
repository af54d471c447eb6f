// Stable sorts: keys with the permutation that sorts them, and items into buckets. The result of a
// stable sort is unique, so it is bitwise the same on any backend and for any number of threads.
//
// Least significant digit first (Knuth, The Art of Computer Programming 3, section 5.2.5): in each
// pass every chunk of the keys counts its digits, a scan over (digit, chunk) says where each chunk
// puts the keys of a digit, and the chunks move their keys there in order. One thread does a chunk,
// so nothing is atomic. Few buckets are sorted into on the host as if they were one digit.
#pragma once

#include <taut/core/exec/copy.hpp>
#include <taut/core/exec/scan.hpp>

#include <algorithm>
#include <bit>
#include <type_traits>

namespace taut {

namespace kernels {

inline constexpr int digit_bits = 8, digits = 1 << digit_bits;

template <class S, class Key>
struct SortPass {
  Kokkos::View<Key const*, typename S::memory> key;
  Kokkos::View<int const*, typename S::memory> order;  ///< empty: the identity
  Kokkos::View<int*, typename S::memory> count;        ///< [digit][chunk]
  int n, chunk_length, chunks, shift;

  KOKKOS_FUNCTION int first(int chunk) const { return chunk * chunk_length; }
  KOKKOS_FUNCTION int last(int chunk) const {
    return first(chunk) + Kokkos::min(chunk_length, n - first(chunk));
  }
  KOKKOS_FUNCTION int& counter(int chunk, int k) const {
    return count(static_cast<int>(key(k) >> shift & Key(digits - 1)) * chunks + chunk);
  }
};

template <class S, class Key>
struct CountDigits : SortPass<S, Key> {
  KOKKOS_FUNCTION void operator()(int chunk) const {
    for (int d = 0; d < digits; ++d) this->count(d * this->chunks + chunk) = 0;
    for (int k = this->first(chunk); k < this->last(chunk); ++k) ++this->counter(chunk, k);
  }
};

template <class S, class Key>
struct MoveKeys : SortPass<S, Key> {
  Kokkos::View<Key*, typename S::memory> key_to;
  Kokkos::View<int*, typename S::memory> order_to;
  KOKKOS_FUNCTION void operator()(int chunk) const {
    for (int k = this->first(chunk); k < this->last(chunk); ++k) {
      int const to = this->counter(chunk, k)++;
      key_to(to) = this->key(k);
      order_to(to) = this->order.extent(0) > 0 ? this->order(k) : k;
    }
  }
};

template <class S, class Key>
struct LargestKey {
  Kokkos::View<Key const*, typename S::memory> key;
  KOKKOS_FUNCTION void operator()(int k, Key& largest) const {
    largest = Kokkos::max(largest, key(k));
  }
};

/// The first item whose bucket does not exist.
template <class S>
struct FindStray {
  Kokkos::View<int const*, typename S::memory> bucket;
  int buckets;
  KOKKOS_FUNCTION void operator()(int k, int& first) const {
    if (bucket(k) < 0 || bucket(k) >= buckets) first = Kokkos::min(first, k);
  }
};

template <class S>
struct CopyBuckets {
  Kokkos::View<int const*, typename S::memory> bucket;
  Kokkos::View<std::uint32_t*, typename S::memory> key;
  KOKKOS_FUNCTION void operator()(int k) const { key(k) = static_cast<std::uint32_t>(bucket(k)); }
};

/// Items in chunks, with a counter per bucket and chunk.
template <class S>
struct BucketPass {
  Kokkos::View<int const*, typename S::memory> bucket;
  Kokkos::View<int*, typename S::memory> count;  ///< [bucket][chunk]
  int n, buckets, chunks;

  KOKKOS_FUNCTION int first(int chunk) const {
    return static_cast<int>(std::int64_t(n) * chunk / chunks);
  }
  KOKKOS_FUNCTION int& counter(int b, int chunk) const { return count(b * chunks + chunk); }
};

template <class S>
struct CountItems : BucketPass<S> {
  KOKKOS_FUNCTION void operator()(int chunk) const {
    for (int b = 0; b < this->buckets; ++b) this->counter(b, chunk) = 0;
    for (int k = this->first(chunk); k < this->first(chunk + 1); ++k) {
      ++this->counter(this->bucket(k), chunk);
    }
  }
};

/// Of bucket b, once the counters are places.
template <class S>
struct BeginCounted : BucketPass<S> {
  Kokkos::View<int*, typename S::memory> begin;
  KOKKOS_FUNCTION void operator()(int b) const {
    begin(b) = b < this->buckets ? this->counter(b, 0) : this->n;
  }
};

template <class S>
struct PlaceItems : BucketPass<S> {
  Kokkos::View<int*, typename S::memory> order;
  KOKKOS_FUNCTION void operator()(int chunk) const {
    for (int k = this->first(chunk); k < this->first(chunk + 1); ++k) {
      order(this->counter(this->bucket(k), chunk)++) = k;
    }
  }
};

/// From sorted keys, for k in [0, n]: the buckets after that of item k - 1 up to that of item k
/// begin at k.
template <class S>
struct BeginBuckets {
  Kokkos::View<std::uint32_t const*, typename S::memory> key;
  Kokkos::View<int*, typename S::memory> begin;
  int n, buckets;
  KOKKOS_FUNCTION void operator()(int k) const {
    int const from = k == 0 ? 0 : static_cast<int>(key(k - 1)) + 1;
    int const to = k == n ? buckets : static_cast<int>(key(k));
    for (int b = from; b <= to; ++b) begin(b) = k;
  }
};

}  // namespace kernels

/// Stable sorts of up to `max_keys` unsigned keys. Owns its scratch memory, so that a sort
/// allocates nothing.
template <class S, class Key = std::uint32_t>
requires std::unsigned_integral<Key>
class StableSort {
public:
  using Keys = Kokkos::View<Key*, typename S::memory>;
  using Order = Kokkos::View<int*, typename S::memory>;

  /// Keys that one thread moves: long on the host, where the counters of a chunk should be few
  /// beside its keys; short on a device, where there are thousands of threads to feed. Without
  /// effect on the result.
  static constexpr int chunk_length = S::on_host ? 4096 : 256;

  StableSort() = default;
  explicit StableSort(int max_keys)
      : max_keys_(max_keys),
        key_("sort_key", max_keys),
        order_("sort_order", max_keys),
        count_("sort_count", std::size_t(kernels::digits) * chunks(max_keys)) {}

  /// Sorts the first n keys, ascending; order(k) becomes the place that the k-th of them had, so
  /// equal keys keep theirs. Passes over digits that are zero in all keys are left out. Throws
  /// Error if the arrays or the scratch memory are too short.
  void sort(int n, Keys const& keys, Order const& order) const {
    if (n > max_keys_ || keys.extent(0) < std::size_t(n) || order.extent(0) < std::size_t(n)) {
      throw Error("sort: {} keys do not fit scratch memory for {}, {} keys and an order of {}", n,
                  max_keys_, keys.extent(0), order.extent(0));
    }
    using Pass = kernels::SortPass<S, Key>;
    int const bits =
        std::bit_width(maximum<S>("sort_largest", n, Key(0), kernels::LargestKey<S, Key>{keys}));
    int const count = chunks(n);
    Order const counts(count_, Kokkos::make_pair(0, kernels::digits * count));
    Keys key_from = keys, key_to = key_;
    Order order_from, order_to = order, order_next = order_;
    // At least one pass, which writes the order.
    for (int shift = 0; shift == 0 || shift < bits; shift += kernels::digit_bits) {
      Pass const pass{key_from, order_from, counts, n, chunk_length, count, shift};
      for_each<S>("sort_count", count, kernels::CountDigits<S, Key>{pass});
      exclusive_scan<S, int>("sort_scan", counts);
      for_each<S>("sort_move", count, kernels::MoveKeys<S, Key>{pass, key_to, order_to});
      std::swap(key_from, key_to);
      order_from = order_to;
      std::swap(order_to, order_next);
    }
    if (key_from.data() != keys.data()) copy(n, key_from, keys);
    if (order_from.data() != order.data()) copy(n, order_from, order);
  }

private:
  static int chunks(int n) { return n / chunk_length + (n % chunk_length > 0); }
  template <class View>
  static void copy(int n, View const& from, View const& to) {
    auto const range = Kokkos::make_pair(0, n);
    assign_on<S>(Kokkos::subview(to, range), Kokkos::subview(from, range));
  }

  int max_keys_ = 0;
  Keys key_;
  Order order_, count_;
};

/// Puts up to `max_items` items into buckets: which items are in each, ascending. What incidence
/// lists, cells of a grid and their like are made of. Owns its scratch memory.
template <class S>
class BucketSort {
public:
  using Indices = Kokkos::View<int*, typename S::memory>;

  BucketSort() = default;
  explicit BucketSort(int max_items)
      : sort_(max_items),
        key_("bucket_key", max_items),
        count_("bucket_count", S::on_host ? max_items : 0) {}

  /// Item k < n goes into bucket(k). Afterwards bucket b holds the items order(begin(b)), ...,
  /// order(begin(b + 1) - 1), ascending; `begin` has buckets + 1 entries. Throws Error if an item
  /// names a bucket that does not exist, or an array is too short.
  void sort(int n, Kokkos::View<int const*, typename S::memory> const& bucket, int buckets,
            Indices const& begin, Indices const& order) const {
    if (key_.extent(0) < std::size_t(n) || bucket.extent(0) < std::size_t(n) ||
        begin.extent(0) < std::size_t(buckets) + 1 || order.extent(0) < std::size_t(n)) {
      throw Error(
          "bucket sort: {} items in {} buckets do not fit scratch memory for {}, {} items, "
          "{} begins and an order of {}",
          n, buckets, key_.extent(0), bucket.extent(0), begin.extent(0), order.extent(0));
    }
    int const stray = minimum<S>("bucket_check", n, n, kernels::FindStray<S>{bucket, buckets});
    if (stray < n) {
      throw Error("bucket sort: item {} names a bucket that is not one of the {}", stray, buckets);
    }
    if (int const chunks = counted_chunks(n, buckets); chunks > 0) {
      kernels::BucketPass<S> const pass{bucket, count_, n, buckets, chunks};
      for_each<S>("bucket_count", chunks, kernels::CountItems<S>{pass});
      Indices const counts(count_, Kokkos::make_pair(0, buckets * chunks));
      exclusive_scan<S, int>("bucket_scan", counts);
      for_each<S>("bucket_begin", buckets + 1, kernels::BeginCounted<S>{pass, begin});
      for_each<S>("bucket_place", chunks, kernels::PlaceItems<S>{pass, order});
      return;
    }
    for_each<S>("bucket_copy", n, kernels::CopyBuckets<S>{bucket, key_});
    sort_.sort(n, key_, order);
    for_each<S>("bucket_begin", n + 1, kernels::BeginBuckets<S>{key_, begin, n, buckets});
  }

private:
  /// Into how many chunks to count, one per thread at most, with no more counters than items; 0: on
  /// a device, whose chunks are short, and where there are too many buckets.
  int counted_chunks(int n, int buckets) const {
    if (!S::on_host || buckets < 1) return 0;
    int const chunks = std::min(S::instance().concurrency(), n / sort_.chunk_length + 1);
    return std::min(chunks, n / buckets);
  }

  StableSort<S, std::uint32_t> sort_;
  Kokkos::View<std::uint32_t*, typename S::memory> key_;
  Indices count_;
};

}  // namespace taut
