// Gates of a path: time per gate that its length falls under.
#include <benchmark/benchmark.h>

#include <cmath>
#include <vector>

#include "core/gates/gate.h"

namespace isochron {
namespace {

constexpr double kWidth = 0.0048;  // 16 ps
constexpr int kBins = 512, kLong = 130;

/// Contiguous bins with a decaying response as long as 130 of them; `rows` of it per bin.
GateSet bins(double rows, bool even) {
  std::vector<double> offsets, values, centers;
  for (int i = 0; i <= rows * kLong; ++i) {
    offsets.push_back((i + (even ? 0 : 0.3 * std::sin(i))) * kWidth / rows);
    values.push_back(i * std::exp(-0.1 * i / rows));
  }
  for (int g = 0; g < kBins; ++g) centers.push_back((g + 0.5) * kWidth);
  return GateSet(GateShape::bin(kWidth, offsets, values), centers);
}

GateSet gaussians() {
  std::vector<double> centers;
  for (int g = 0; g < kBins; ++g) centers.push_back((g + 0.5) * kWidth);
  return GateSet(GateShape::gaussian(kLong * kWidth / 17), centers);
}

void run(benchmark::State& state, const GateSet& gates, bool derivatives) {
  double l = gates.lower(), sum = 0;
  long long calls = 0;
  const double step = 0.618 * (gates.upper() - gates.lower());
  for (auto _ : state) {
    l += step;
    if (l > gates.upper()) l += gates.lower() - gates.upper();
    if (derivatives)
      gates.for_each_derivative(l, [&](int, double w, double slope) { sum += w + slope, ++calls; });
    else
      gates.for_each_value(l, [&](int, double w) { sum += w, ++calls; });
  }
  benchmark::DoNotOptimize(sum);
  state.counters["s/gate"] =
      benchmark::Counter(static_cast<double>(calls), benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void bins_of_whole_steps(benchmark::State& state) {
  run(state, bins(4, true), state.range(0));
}
void bins_of_broken_steps(benchmark::State& state) {
  run(state, bins(2.7, true), state.range(0));
}
void bins_of_uneven_steps(benchmark::State& state) {
  run(state, bins(4, false), state.range(0));
}
void many_gaussians(benchmark::State& state) {
  run(state, gaussians(), state.range(0));
}
BENCHMARK(bins_of_whole_steps)->ArgName("derivatives")->Arg(0)->Arg(1);
BENCHMARK(bins_of_broken_steps)->ArgName("derivatives")->Arg(0)->Arg(1);
BENCHMARK(bins_of_uneven_steps)->ArgName("derivatives")->Arg(0)->Arg(1);
BENCHMARK(many_gaussians)->ArgName("derivatives")->Arg(0)->Arg(1);

}  // namespace
}  // namespace isochron
