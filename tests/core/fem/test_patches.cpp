// What sweeps over patches ask a device for, computed on the host: packs of 32 and nothing run.
#include "elastic_samples.hpp"

#include <taut/core/exec/parallel.hpp>
#include <taut/core/fem/patches.hpp>

#include <catch2/catch_test_macros.hpp>
#include <catch2/generators/catch_generators.hpp>

using namespace taut;

namespace {

constexpr int warp = 32;
/// What a block of threads has on every NVIDIA GPU, and what a team of 1024 uses of it for itself.
constexpr std::size_t block_memory = 48 * 1024, of_team = 1026 * sizeof(double) + 8;

/// Bytes of a gradient sweep over the patches of a mesh.
std::size_t bytes_of(test::Sample const& body, int patch_size, int numbers, std::size_t number) {
  Patches const p = make_patches(body.rest.tets, body.material_of_tet,
                                 static_cast<int>(body.rest.points.size()), warp, patch_size);
  return kernels::gradient_sweep_bytes(p.max_packs, warp, p.max_locals, numbers, number);
}

}  // namespace

TEST_CASE("the usual sweeps fit into the fast memory of a team of a device", "[fem]") {
  test::Sample const body(GENERATE(6, 10));
  auto const level = [&](int patch_size, int numbers, std::size_t number) {
    std::size_t const bytes = bytes_of(body, patch_size, numbers, number);
    int const chosen = kernels::scratch_level(bytes, block_memory - of_team);
    if (chosen == 0) CHECK(bytes + of_team <= block_memory);
    return chosen;
  };
  int const single = kernels::device_patch_size(warp, sizeof(float));
  int const twice = kernels::device_patch_size(warp, sizeof(double));
  CHECK(single % warp == 0);
  CHECK(single >= 128);
  CHECK(twice >= 128);
  for (int numbers : {3, 6, 9}) CHECK(level(single, numbers, sizeof(float)) == 0);
  for (int numbers : {3, 6}) CHECK(level(twice, numbers, sizeof(double)) == 0);
  // Blocks in double precision, and patches of the host's size, take the memory behind it.
  CHECK(level(twice, 9, sizeof(double)) == 1);
  for (int numbers : {6, 9}) CHECK(level(512, numbers, sizeof(float)) == 1);
}

TEST_CASE("the host cuts patches of 512 tets", "[fem]") {
  STATIC_REQUIRE(default_patch_size<DefaultSpace, float>() == 512);
  STATIC_REQUIRE(default_patch_size<SerialSpace, double>() == 512);
}
