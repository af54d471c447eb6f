// Compressed lists on the host: which items are in each bucket. What set-up code builds incidence
// lists with; loops on a device have BucketSort (sort.hpp), which gives the same.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace taut {

struct Buckets {
  std::vector<int> begin;  ///< buckets + 1
  std::vector<int> item;   ///< of bucket b: item[begin[b]] to item[begin[b + 1] - 1], ascending
};

/// Item k goes into bucket[k], one of [0, buckets).
inline Buckets sort_into_buckets(std::span<int const> bucket, int buckets) {
  Buckets lists{std::vector<int>(buckets + 1, 0), std::vector<int>(bucket.size())};
  for (int b : bucket) ++lists.begin[b + 1];
  for (int b = 0; b < buckets; ++b) lists.begin[b + 1] += lists.begin[b];
  std::vector<int> next(lists.begin.begin(), lists.begin.end() - 1);
  for (std::size_t k = 0; k < bucket.size(); ++k) {
    lists.item[next[bucket[k]]++] = static_cast<int>(k);
  }
  return lists;
}

}  // namespace taut
