#include <taut/apps/bench/machine.hpp>
#include <taut/core/exec/parallel.hpp>
#include <taut/core/math/scalar.hpp>

namespace taut {
namespace {

using S = DefaultSpace;

struct Triad {
  Array<double, S> a, b, c;
  double s;
  KOKKOS_FUNCTION void operator()(int i) const { a(i) = b(i) + s * c(i); }
};

/// Independent chains of multiply-adds: more of them than a unit has stages, fewer than registers.
template <class Real>
struct MultiplyAdds {
  using T = std::conditional_t<S::on_host, HostPack<Real>, Real>;
  static constexpr int chains = 12;
  int steps;
  Array<double, S> result;

  KOKKOS_FUNCTION void operator()(int i) const {
    T a[chains];
    for (int k = 0; k < chains; ++k) a[k] = T(Real(k + 1));
    T const factor(Real(0.999)), term(Real(1e-3));
    for (int step = 0; step < steps; ++step)
      for (int k = 0; k < chains; ++k) a[k] = Kokkos::fma(a[k], factor, term);
    double sum = 0;
    for (int k = 0; k < chains; ++k) sum += sum_lanes(a[k]);
    result(i) = sum;
  }
  double flops() const {
    return 2.0 * chains * ScalarTraits<T>::lanes * steps * double(result.extent(0));
  }
};

template <class Real>
double multiply_add_rate(int tasks, double seconds) {
  MultiplyAdds<Real> const kernel{1 << 15, Array<double, S>("fma_result", tasks)};
  auto const run = [&] {
    for_each<S>("fma_rate", tasks, kernel);
    Kokkos::fence("taut: fma rate");
  };
  run();
  return 1e-9 * kernel.flops() / best_seconds(seconds, run);
}

double triad_rate(double seconds) {
  int const n = 1 << 24;  // three times 128 MiB: far beyond any cache
  Triad const kernel{Array<double, S>("a", n), Array<double, S>("b", n), Array<double, S>("c", n),
                     3.0};
  auto const run = [&] {
    for_each<S>("triad", n, kernel);
    Kokkos::fence("taut: triad");
  };
  run();
  return 1e-9 * 24 * n / best_seconds(seconds, run);
}

}  // namespace

MachineRates measure_machine(double seconds) {
  MachineRates rates;
  rates.threads = S::execution().concurrency();
  rates.triad = triad_rate(seconds);
  rates.fma32 = multiply_add_rate<float>(rates.threads, seconds);
  rates.fma64 = multiply_add_rate<double>(rates.threads, seconds);
  return rates;
}

}  // namespace taut
