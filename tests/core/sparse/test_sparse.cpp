// Patterns, assembly and products of block matrices against plain dense loops.
#include "samples.hpp"

#include <taut/core/report/error.hpp>
#include <taut/core/sparse/operations.hpp>

#include <catch2/catch_template_test_macros.hpp>
#include <catch2/catch_test_macros.hpp>
#include <catch2/matchers/catch_matchers_string.hpp>

#include <algorithm>
#include <set>

namespace {

using namespace taut;
using namespace taut::test;
using Catch::Matchers::ContainsSubstring;

using LeftSpace = Space<Kokkos::Serial, Kokkos::LayoutLeft>;

std::vector<double> dense_product(BlockCsr<SerialSpace> const& a, std::vector<double> const& x) {
  Dense const full = dense(a);
  std::vector<double> y(x.size(), 0.0);
  for (std::size_t i = 0; i < x.size(); ++i)
    for (std::size_t j = 0; j < x.size(); ++j) y[i] += full[i][j] * x[j];
  return y;
}

/// Every kernel of a colour adds the element matrix [B, -B; -B, B] of its edge.
struct AddEdge {
  BlockCsr<DefaultSpace> a;
  Array<int, DefaultSpace> edges;
  KOKKOS_FUNCTION void operator()(int e) const {
    double const stiffness = 1.0 + edges(2 * e);
    for (int p = 0; p < 2; ++p)
      for (int q = 0; q < 2; ++q)
        a.add(edges(2 * e + p), edges(2 * e + q),
              (p == q ? stiffness : -stiffness) * identity3<double>());
  }
};

}  // namespace

TEST_CASE("the pattern of two tets that share a face, and of an unknown without an element") {
  std::vector<int> const tets{4, 1, 2, 3, 1, 2, 3, 0};
  Connectivity const kind{tets, 4};
  BlockPattern const pattern = pattern_from_elements(6, {&kind, 1});
  CHECK(pattern.row_begin == std::vector<int>{0, 4, 9, 14, 19, 23, 24});
  CHECK(pattern.column ==
        std::vector<int>{0, 1, 2, 3, 0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 0, 1, 2, 3, 4, 1, 2, 3, 4, 5});
}

TEST_CASE("patterns of mixed elements equal sets of neighbours") {
  int const n = 40;
  std::mt19937 random(3);
  std::vector<int> tets, springs;
  for (int k = 0; k < 4 * 25; ++k) tets.push_back(static_cast<int>(random() % n));
  for (int k = 0; k < 2 * 30; ++k) springs.push_back(static_cast<int>(random() % n));

  std::vector<std::set<int>> expected(n);
  for (int i = 0; i < n; ++i) expected[i].insert(i);
  for (std::size_t k = 0; k < tets.size(); ++k)
    for (int q = 0; q < 4; ++q) expected[tets[k]].insert(tets[k / 4 * 4 + q]);
  for (std::size_t k = 0; k < springs.size(); ++k)
    for (int q = 0; q < 2; ++q) expected[springs[k]].insert(springs[k / 2 * 2 + q]);

  std::vector<Connectivity> const kinds{{tets, 4}, {springs, 2}};
  BlockPattern const pattern = pattern_from_elements(n, kinds);
  REQUIRE(pattern.row_begin.size() == n + 1);
  for (int i = 0; i < n; ++i) {
    std::vector<int> const row(pattern.column.begin() + pattern.row_begin[i],
                               pattern.column.begin() + pattern.row_begin[i + 1]);
    CHECK(row == std::vector<int>(expected[i].begin(), expected[i].end()));
  }
}

TEST_CASE("a pattern refuses elements that cannot be") {
  std::vector<int> const vertices{0, 1, 2, 3, 1, 2, 3, 7};
  Connectivity kind{vertices, 4};
  CHECK_THROWS_WITH(pattern_from_elements(7, {&kind, 1}),
                    ContainsSubstring("element 1 names unknown 7, but there are 7"));
  kind.per_element = 3;
  CHECK_THROWS_WITH(pattern_from_elements(8, {&kind, 1}),
                    ContainsSubstring("8 vertex indices are not whole elements of 3"));
}

TEST_CASE("find tells every stored block from every other") {
  auto const a = lattice_matrix<SerialSpace>(3, 1.0);
  Dense const full = dense(a);
  for (int i = 0; i < a.rows(); ++i) {
    for (int j = 0; j < a.rows(); ++j) {
      int const k = a.find(i, j);
      CHECK((k >= 0) == (full[3 * i][3 * j] != 0));
      if (k >= 0) CHECK((k < a.row_begin(i + 1) && a.column(k) == j));
    }
  }
}

TEST_CASE("assembly by colours gives the element sums") {
  int const n = 50;  // a chain: even and odd edges are the two colours
  std::vector<int> edges;
  for (int const colour : {0, 1})
    for (int i = colour; i + 1 < n; i += 2) edges.insert(edges.end(), {i, i + 1});
  Connectivity const kind{edges, 2};
  BlockCsr<DefaultSpace> const a(pattern_from_elements(n, {&kind, 1}));

  std::size_t const even = 2 * (n / 2);
  for (auto const& [first, last] :
       {std::pair(std::size_t(0), even), std::pair(even, edges.size())}) {
    Array<int, DefaultSpace> const colour("colour", last - first);
    auto const host = Kokkos::create_mirror_view(colour);
    std::copy(edges.begin() + first, edges.begin() + last, host.data());
    assign(colour, host);
    for_each<DefaultSpace>("add_edges", static_cast<int>((last - first) / 2), AddEdge{a, colour});
    Kokkos::fence();
  }

  auto const host = host_copy(a);
  for (int i = 0; i < n; ++i) {
    double const before = i > 0 ? i : 0, after = i + 1 < n ? i + 1 : 0;
    CHECK(host.block(host.find(i, i))(1, 1) == before + after);
    CHECK(host.block(host.find(i, i))(0, 1) == 0);
    if (i + 1 < n) CHECK(host.block(host.find(i, i + 1))(2, 2) == -after);
  }
}

TEMPLATE_TEST_CASE("products equal dense products in every layout", "", LeftSpace, DefaultSpace) {
  auto const a = lattice_matrix<TestType>(4, 0.1);
  auto const oracle = lattice_matrix<SerialSpace>(4, 0.1);
  auto const x = random_field<double, TestType>(a.rows(), 1);
  VectorField<double, TestType> const y("y", a.rows());
  product(a, x, y);
  CHECK(relative_difference(numbers(y), dense_product(oracle, numbers(x))) < 1e-15);

  SECTION("bitwise as on one thread") {
    auto const x1 = random_field<double, SerialSpace>(a.rows(), 1);
    VectorField<double, SerialSpace> const y1("y", a.rows());
    product(oracle, x1, y1);
    // A device contracts products and sums otherwise.
    if (TestType::on_host) CHECK(numbers(y) == numbers(y1));
  }
  SECTION("in single precision") {
    BlockCsr<TestType, float> a32;
    a32.row_begin = a.row_begin;
    a32.column = a.column;
    a32.block = decltype(a32.block)("block", a.block.extent(0));
    auto const from = Kokkos::create_mirror_view_and_copy(Kokkos::HostSpace(), a.block);
    auto const to = Kokkos::create_mirror_view(a32.block);
    for (std::size_t k = 0; k < from.extent(0); ++k)
      for (int m = 0; m < 9; ++m) to(k).a[m] = static_cast<float>(from(k).a[m]);
    assign(a32.block, to);
    auto const x32 = random_field<float, TestType>(a.rows(), 1);
    VectorField<float, TestType> const y32("y", a.rows());
    product(a32, x32, y32);
    CHECK(relative_difference(numbers(y32), dense_product(oracle, numbers(x))) < 1e-6);
    product(a32, x, y);  // single storage, double vectors: only the entries are rounded
    CHECK(relative_difference(numbers(y), dense_product(oracle, numbers(x))) < 1.2e-7);
  }
}

TEST_CASE("the diagonal is read with its symmetric part") {
  auto const a = lattice_matrix<DefaultSpace>(3, 1.0);
  auto const host = host_copy(a);
  host.block(host.find(5, 5))(0, 1) += 0.5;
  host.block(host.find(5, 5))(1, 0) -= 0.5;
  assign(a.block, host.block);
  BlockField<double, DefaultSpace> const diagonal("diagonal", a.rows());
  diagonal_blocks(a, diagonal);
  auto const original = lattice_matrix<SerialSpace>(3, 1.0);
  int const r[6] = {0, 1, 2, 0, 1, 0}, c[6] = {0, 1, 2, 1, 2, 2};
  std::vector<double> const found = numbers(diagonal);
  for (int i = 0; i < a.rows(); ++i)
    for (int k = 0; k < 6; ++k)
      CHECK(found[6 * i + k] == original.block(original.find(i, i))(r[k], c[k]));
}

TEST_CASE("asymmetry is the largest relative mismatch of mirrored entries") {
  auto const a = lattice_matrix<SerialSpace>(3, 1.0);
  CHECK(asymmetry(a) == 0);
  double largest = 0;
  for (auto const& row : dense(a))
    for (double const entry : row) largest = std::max(largest, std::abs(entry));
  a.block(a.find(0, 1))(2, 0) += 1e-3 * largest;
  CHECK(std::abs(asymmetry(a) / 1e-3 - 1) < 1e-9);

  BlockPattern const triangle{{0, 2, 3}, {0, 1, 1}};
  CHECK(asymmetry(BlockCsr<SerialSpace>(triangle)) == std::numeric_limits<double>::infinity());
}
