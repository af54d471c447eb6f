// Particles of a body, spread as blue noise: no two are near each other, and there is no other
// order in them.
#pragma once

#include <taut/mpm/particles.hpp>
#include <taut/mpm/solid.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace taut {

/// Points in the unit cube that repeats in all directions, no two nearer than `distance`.
struct BlueNoise {
  std::vector<Vec3<double>> points;
  double distance = 0;
};

/// `count` points by throwing darts: a dart that hits near an earlier one is thrown away, and when
/// hardly any finds room the distance shrinks a little (McCool and Fiume 1992). count * distance^3
/// ends near 0.65; random points would have pairs at any distance. Depends on `seed` alone.
BlueNoise blue_noise(int count, std::uint64_t seed);

/// A body to be made of particles.
struct ParticleBody {
  std::string name = {};
  Solid solid = {};
  double density = 1000;    ///< kg/m^3
  double per_cell = 8;      ///< particles in a cell of the grid
  int material = 0;         ///< of the term over the particles
  Vec3<double> velocity{};  ///< m/s
};

struct SamplingParams {
  std::uint64_t seed = 1;
  bool check_overlap = true;  ///< bodies that hold points of each other are refused
};

/// The particles of all bodies, one body after the other, for a grid of spacing dx (m); a
/// particle's object is the place of its body in the list. The particles of a body have one volume
/// and one mass, and together the body's.
///
/// Throws Error for a body that has no room for a particle, a number that cannot be, or bodies that
/// overlap.
std::vector<Particle> sample(std::span<ParticleBody const> bodies, double dx,
                             SamplingParams const& params = {});

}  // namespace taut
