// Rows of four and eight in memory, loaded to and added from packs, against loops over single
// numbers.
#include <taut/core/math/row_pairs.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>

#include <limits>
#include <random>
#include <vector>

using namespace taut;

namespace {

template <class T>
struct Rows {
  using Real = ValueType<T>;
  static constexpr int lanes = ScalarTraits<T>::lanes, count = 3 * lanes;

  std::mt19937 random{11};
  std::vector<std::uint16_t> begin = std::vector<std::uint16_t>(lanes);

  Real number() { return static_cast<Real>(std::uniform_real_distribution<double>(-1, 1)(random)); }
  std::vector<Real> numbers(int n) {
    std::vector<Real> all(n);
    for (Real& v : all) v = number();
    return all;
  }
  /// Rows for the lanes: all different, any, or all the same.
  void draw(int repeat) {
    for (int i = 0; i < lanes; ++i) {
      int const row = repeat % 3 == 0   ? (i * 5 + repeat) % count
                      : repeat % 3 == 1 ? static_cast<int>(random() % count)
                                        : repeat % count;
      begin[i] = static_cast<std::uint16_t>(4 * row);
    }
  }
};

template <int numbers, int scale, class T>
void check_add(Rows<T>& rows) {
  using Real = ValueType<T>;
  constexpr int lanes = ScalarTraits<T>::lanes;
  for (int repeat = 0; repeat < 30; ++repeat) {
    rows.draw(repeat);
    // `row` holds twelve numbers, whatever is used of them.
    T row[12];
    std::vector<Real> const source = rows.numbers(12 * lanes);
    for (int c = 0; c < 12; ++c) row[c] = load<T>(source.data() + c * lanes);
    std::vector<Real> to = rows.numbers(4 * scale * rows.count + 4), expected = to;
    for (int i = 0; i < lanes; ++i)
      for (int c = 0; c < numbers; ++c) {
        expected[scale * rows.begin[i] + c] += source[c * lanes + i];
      }
    add_rows<numbers, scale>(row, to.data(), rows.begin.data());
    if (to != expected) FAIL(numbers << " numbers, scale " << scale << ", repeat " << repeat);
  }
}

template <int scale, class T>
void check_scale(Rows<T>& rows) {
  check_add<1, scale>(rows);
  check_add<2, scale>(rows);
  check_add<3, scale>(rows);
  check_add<4, scale>(rows);
}

/// Rows that take several quads each.
template <int scale, class T>
void check_long_rows(Rows<T>& rows) {
  check_add<5, scale>(rows);
  check_add<6, scale>(rows);
  check_add<7, scale>(rows);
  check_add<8, scale>(rows);
  if constexpr (scale > 2) {
    check_add<9, scale>(rows);
    check_add<12, scale>(rows);
  }
}

}  // namespace

TEMPLATE_TEST_CASE("load_rows is a gather of three numbers", "[math]", float, double,
                   HostPack<float>, HostPack<double>) {
  using T = TestType;
  Rows<T> rows;
  std::vector<ValueType<T>> const from = rows.numbers(4 * rows.count);
  for (int repeat = 0; repeat < 300; ++repeat) {
    rows.draw(repeat);
    T to[3];
    load_rows(from.data(), rows.begin.data(), to);
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < rows.lanes; ++i) {
        if (lane(to[c], i) != from[rows.begin[i] + c]) FAIL("number " << c << " of lane " << i);
      }
  }
}

TEMPLATE_TEST_CASE("add_rows adds lane after lane, also to one row", "[math]", float, double,
                   HostPack<float>, HostPack<double>) {
  Rows<TestType> rows;
  check_scale<1>(rows);
  check_scale<2>(rows);
  check_scale<3>(rows);
  check_long_rows<2>(rows);
  check_long_rows<3>(rows);
}

TEMPLATE_TEST_CASE("load_row_pairs gathers both vectors of rows of eight", "[math]", float, double,
                   HostPack<float>, HostPack<double>) {
  using T = TestType;
  Rows<T> rows;
  std::vector<ValueType<T>> const from = rows.numbers(8 * rows.count);
  for (int repeat = 0; repeat < 300; ++repeat) {
    rows.draw(repeat);
    T a[3], b[3];
    load_row_pairs(from.data(), rows.begin.data(), a, b);
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < rows.lanes; ++i) {
        std::size_t const row = 2 * std::size_t(rows.begin[i]);
        if (lane(a[c], i) != from[row + c]) FAIL("first vector, " << c << " of lane " << i);
        if (lane(b[c], i) != from[row + 4 + c]) FAIL("second vector, " << c << " of lane " << i);
      }
  }
}

TEMPLATE_TEST_CASE("rows hold differences, and their largest passes over what is no number",
                   "[math]", float, double) {
  Kokkos::View<double* [3], Kokkos::LayoutLeft, Kokkos::HostSpace> const field("field", 3);
  for (int i = 0; i < 3; ++i)
    for (int c = 0; c < 3; ++c) field(i, c) = 1e6 + 0.5 * i - 0.25 * c;
  field(2, 1) = std::numeric_limits<double>::quiet_NaN();
  double const origin[3] = {1e6, 1e6 + 1, 1e6};
  LargestOfRows<TestType> largest;
  for (int i = 0; i < 3; ++i) {
    TestType row[4] = {9, 9, 9, 9};
    store_relative(field, i, origin, row);
    for (int c = 0; c < 3; ++c) {
      if (i < 2 || c != 1) CHECK(row[c] == TestType(field(i, c) - origin[c]));
    }
    CHECK(row[3] == 0);
    largest.add(row);
  }
  CHECK(largest.get() == TestType(1.25));
}
