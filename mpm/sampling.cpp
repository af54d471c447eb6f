#include <taut/core/report/error.hpp>
#include <taut/mpm/sampling.hpp>

#include <algorithm>
#include <cmath>
#include <memory>

namespace taut {
namespace {

/// splitmix64 (Steele, Lea and Flood 2014): a counter, mixed.
class Random {
public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return z ^ z >> 31;
  }
  /// In [0, 1).
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }

private:
  std::uint64_t state_;
};

/// Points by cell of a periodic grid.
class Neighbours {
public:
  explicit Neighbours(int count)
      : n_(std::max(1, static_cast<int>(std::cbrt(static_cast<double>(count))))),
        cells_(std::size_t(n_) * n_ * n_) {}

  void add(Vec3<double> const& x) { cells_[cell(x)].push_back(x); }
  bool any_within(Vec3<double> const& x, double distance) const {
    int const reach = static_cast<int>(std::ceil(distance * n_));
    int at[3];
    for (int c = 0; c < 3; ++c) at[c] = static_cast<int>(x[c] * n_);
    int const span = std::min(2 * reach + 1, n_);
    for (int i = 0; i < span; ++i)
      for (int j = 0; j < span; ++j)
        for (int k = 0; k < span; ++k) {
          std::size_t const cell =
              (std::size_t(wrap(at[0] - reach + i)) * n_ + std::size_t(wrap(at[1] - reach + j))) *
                  n_ +
              std::size_t(wrap(at[2] - reach + k));
          for (Vec3<double> const& y : cells_[cell]) {
            double d2 = 0;
            for (int c = 0; c < 3; ++c) {
              double d = std::abs(x[c] - y[c]);
              d = std::min(d, 1 - d);
              d2 += d * d;
            }
            if (d2 < distance * distance) return true;
          }
        }
    return false;
  }

private:
  int wrap(int i) const { return (i % n_ + n_) % n_; }
  std::size_t cell(Vec3<double> const& x) const {
    std::size_t k = 0;
    for (int c = 0; c < 3; ++c) k = k * n_ + std::size_t(wrap(static_cast<int>(x[c] * n_)));
    return k;
  }
  int n_;
  std::vector<std::vector<Vec3<double>>> cells_;
};

void check(ParticleBody const& body) {
  auto const refuse = [&](char const* what, double value) {
    throw Error("body \"{}\": {} = {}; give one above 0", body.name, what, value);
  };
  auto const good = [](double value) { return value > 0 && std::isfinite(value); };
  if (!good(body.density)) refuse("density", body.density);
  if (!good(body.per_cell)) refuse("per_cell", body.per_cell);
  if (!good(body.solid.volume)) refuse("volume", body.solid.volume);
  if (!std::isfinite(norm(body.velocity))) {
    throw Error("body \"{}\": its velocity is not finite", body.name);
  }
}

/// The noise, repeated, where the body is.
std::vector<Vec3<double>> places_in(std::string const& name, Solid const& solid,
                                    BlueNoise const& noise, double tile,
                                    Vec3<double> const& shift) {
  int first[3], last[3];
  double tiles = 1;
  for (int c = 0; c < 3; ++c) {
    double const low = (solid.lowest[c] - shift[c]) / tile,
                 high = (solid.highest[c] - shift[c]) / tile;
    tiles *= high - low + 1;
    if (!(std::abs(low) < 1e9 && std::abs(high) < 1e9 && tiles < 1e7)) {
      throw Error(
          "body \"{}\": the box around it reaches over more cells than can be sampled: give a "
          "coarser "
          "grid, or make several bodies of it",
          name);
    }
    first[c] = static_cast<int>(std::floor(low));
    last[c] = static_cast<int>(std::floor(high));
  }
  std::vector<Vec3<double>> places;
  for (int i = first[0]; i <= last[0]; ++i)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int k = first[2]; k <= last[2]; ++k)
        for (Vec3<double> const& q : noise.points) {
          Vec3<double> const x = shift + tile * (Vec3<double>{double(i), double(j), double(k)} + q);
          bool in_box = true;
          for (int c = 0; c < 3; ++c) in_box &= x[c] >= solid.lowest[c] && x[c] <= solid.highest[c];
          if (in_box && solid.holds(x)) places.push_back(x);
        }
  return places;
}

void refuse_overlap(std::span<ParticleBody const> bodies, std::vector<Particle> const& list) {
  for (Particle const& p : list)
    for (std::size_t other = 0; other < bodies.size(); ++other) {
      if (static_cast<int>(other) == p.object || !bodies[other].solid.holds(p.x)) continue;
      throw Error(
          "bodies \"{}\" and \"{}\" overlap, near ({:.4g}, {:.4g}, {:.4g}) m: move one of them, or "
          "cut it out of the other",
          bodies[static_cast<std::size_t>(p.object)].name, bodies[other].name, p.x[0], p.x[1],
          p.x[2]);
    }
}

}  // namespace

BlueNoise blue_noise(int count, std::uint64_t seed) {
  if (count < 1) throw Error("blue noise of {} points: give 1 or more", count);
  Random random(seed);
  Neighbours neighbours(count);
  BlueNoise noise;
  // Beyond what darts can fill: count distance^3 <= 0.73.
  noise.distance = std::min(0.5, std::cbrt(0.72 / count));
  constexpr int patience = 2000;
  int missed = 0;
  while (static_cast<int>(noise.points.size()) < count) {
    Vec3<double> const x{random.unit(), random.unit(), random.unit()};
    if (!neighbours.any_within(x, noise.distance)) {
      noise.points.push_back(x);
      neighbours.add(x);
      missed = 0;
    } else if (++missed == patience) {
      noise.distance *= 0.995;
      missed = 0;
    }
  }
  return noise;
}

std::vector<Particle> sample(std::span<ParticleBody const> bodies, double dx,
                             SamplingParams const& params) {
  if (!(dx > 0) || !std::isfinite(dx)) throw Error("a grid of spacing {} m; give one above 0", dx);
  constexpr int count = 8192;
  BlueNoise const noise = blue_noise(count, params.seed);
  Random random(params.seed ^ 0x5bd1e995u);
  std::vector<Particle> list;
  for (std::size_t b = 0; b < bodies.size(); ++b) {
    ParticleBody const& body = bodies[b];
    check(body);
    double const expected = body.solid.volume / (dx * dx * dx) * body.per_cell;
    if (expected > 1e9) {
      throw Error(
          "body \"{}\" would have {:.3g} particles: give a coarser grid than {} m, or fewer "
          "per cell",
          body.name, expected, dx);
    }
    double const tile = dx * std::cbrt(count / body.per_cell);
    Vec3<double> const shift{tile * random.unit(), tile * random.unit(), tile * random.unit()};
    auto const places = places_in(body.name, body.solid, noise, tile, shift);
    if (places.empty()) {
      throw Error("body \"{}\" has no room for a particle: a cell of {} m is too large for it",
                  body.name, dx);
    }
    double const volume = body.solid.volume / static_cast<double>(places.size());
    for (Vec3<double> const& x : places) {
      Particle p;
      p.x = x;
      p.v = body.velocity;
      p.volume = volume;
      p.mass = body.density * volume;
      p.material = body.material;
      p.object = static_cast<int>(b);
      list.push_back(p);
    }
  }
  if (list.empty()) throw Error("no bodies: there is nothing to make particles of");
  if (params.check_overlap) refuse_overlap(bodies, list);
  return list;
}

}  // namespace taut
