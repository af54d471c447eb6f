#include "form_shares.hpp"

#include <catch2/catch_test_macros.hpp>

using namespace taut;

TEST_CASE("in fp32 the shares of an island are p'Hp of p restricted to it", "[islands]") {
  scenes::check_shares<Fp32>();
}
