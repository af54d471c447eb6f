#include <taut/apps/bench/contact_counts.hpp>

namespace taut {
namespace {

/// Differences 9, e1.e1, e1.e2, e2.e2, e1.b 20, Gram-Schmidt 7 + 5 + 7 + 6, coefficients 3,
/// t 12, its length 6.
constexpr double closest = 75;
/// n 4; the relative distance, a logarithm, value, slope and curvature, times K: 20.
constexpr double energy = closest + 4 + 20 + 2.0 / 3 * 21;
/// K m b' c_a n, and adding it to the vertices.
constexpr double forces = 1 + 4 * 4 + 12;
/// c_a^2 m b'' n_i^2, added.
constexpr double diagonals = 1 + 3 + 4 * 4 + 12;
/// The six numbers of each block.
constexpr double blocks = 1 + 6 + 4 * 7 + 24;
/// Differences of p, their combination, its product with n, squared and scaled.
constexpr double form = 9 + 15 + 5 + 4;
/// Differences of p, a unit normal, the shadows of x and p, and where three lines end.
constexpr double advance = 9 + 10 + 2 * 15 + 6 + 9;

}  // namespace

SweepCounts count_contact(std::string_view kernel, std::string_view precision,
                          ContactSizes const& s) {
  double const real = precision == "fp64" ? 8 : 4, position = precision == "fp32" ? 4 : 8;
  double const pairs = s.contacts * 16, x = s.vertices * 3 * position, p = s.vertices * 3 * real;
  double const parameters = s.contacts * 3 * real;
  if (kernel == "search_hash" || kernel == "search_bvh") {
    // Two numbers per axis of a box, of one, two or three vertices.
    return {x + 8 * s.edges + 12 * s.triangles + 16 * s.candidates,
            6 * (s.vertices + s.edges + s.triangles)};
  }
  if (kernel == "features") return {pairs + x, s.contacts * closest};
  if (kernel == "gradient") return {pairs + parameters + x + 2 * p, s.contacts * (energy + forces)};
  if (kernel == "gradient_diagonal")
    return {pairs + parameters + x + 4 * p, s.contacts * (energy + forces + diagonals)};
  if (kernel == "gradient_blocks")
    return {pairs + parameters + x + 6 * p, s.contacts * (energy + forces + blocks)};
  if (kernel == "quadratic_form") return {pairs + parameters + x + p, s.contacts * (energy + form)};
  if (kernel == "max_step" || kernel == "additive_ccd" || kernel == "pairwise")
    return {pairs + x + p, s.contacts * (closest + advance)};
  if (kernel == "planar" || kernel == "isotropic")
    return {pairs + x + p + s.vertices * position, s.contacts * (closest + advance)};
  if (kernel == "half_dhat") return {p, s.vertices * 7};
  return {0, 0};
}

}  // namespace taut
