#include <taut/core/math/bits.hpp>

#include <catch2/catch_test_macros.hpp>

#include <cstdint>
#include <random>

using namespace taut;

TEST_CASE("bits of words are those that a loop over them finds", "[math]") {
  std::mt19937_64 random(1);
  for (int sample = 0; sample < 100000; ++sample) {
    // Any number of bits, in any place.
    std::uint64_t const word = random() & (sample % 2 == 0 ? random() & random() : ~0ull)
                                              << (random() % 64);
    int lowest = 0, count = 0;
    while (lowest < 64 && (word >> lowest & 1) == 0) ++lowest;
    for (int b = 0; b < 64; ++b) count += static_cast<int>(word >> b & 1);
    REQUIRE(lowest_bit(word) == lowest);
    REQUIRE(count_bits(word) == count);
    auto const half = static_cast<std::uint32_t>(word);
    REQUIRE(lowest_bit(half) == (half == 0 ? 32 : lowest));
  }
}

TEST_CASE("bits are set where something holds", "[math]") {
  std::mt19937 random(2);
  for (int sample = 0; sample < 10000; ++sample) {
    float value[8];
    for (float& v : value) v = static_cast<float>(random() % 5);
    float const bound = static_cast<float>(random() % 5);
    unsigned expected = 0;
    for (int b = 0; b < 8; ++b)
      if (value[b] <= bound) expected += 1u << b;
    REQUIRE(bits_where<8>([&](int b) { return value[b] <= bound; }) == expected);
    REQUIRE(bits_where<1>([&](int b) { return value[b] <= bound; }) == (expected & 1));
  }
}
