#include "core/render/light_rate.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace isochron {
namespace {

/// Rates that are compared. The second is that of the trial.
constexpr std::array kRates = {0.0, 1.0, 0.25, 0.5, 2.0, 4.0};
/// By how much another rate than none must look better.
constexpr double kClearlyBetter = 0.8;

/// Second moments of what samples find, by kRates.
struct Moments {
  std::array<double, kRates.size()> of{};
  void add(const Moments& other) {
    for (std::size_t i = 0; i < of.size(); ++i) of[i] += other.of[i];
  }
  void pack(Packer& packer) const { packer.put(of); }
  void unpack(Unpacker& unpacker) { unpacker.get(of); }
};

/// A contribution v = f / (n_s p_s + n_l p_l) is the same whichever technique found it, so that the sum of v g over all that is
/// found is the integral of f g; with g = f / (p_s + n p_l), for any n, the second moment under a rate of n.
class MomentSink final : public Sink {
 public:
  /// `column`: null for images.
  MomentSink(const Passes& passes, const TangentBasis* column, Moments& moments)
      : gates_(passes.gates), balance_(passes.scene, passes.every_gate), moments_(moments) {
    if (column) rates_.emplace(passes.scene.layout, *column);
  }

  bool differential() const override { return rates_.has_value(); }
  void note_path(const Path& path) override { ratio_ = balance_.light_ratio(path, 0).all; }
  void bind(const LocalDifferential& differential) override { rates_->bind(differential); }
  void add(int, const Rgb& value, double length, GateWeights use) override {
    double squares = 0;
    if (!rates_) {
      gates_.for_each_value(length, [&](int, double w) { squares += w * w; });
      squares *= value.max() * value.max();
    } else if (!rates_->touched().empty()) {
      const ColumnRates::Rates& rates = (*rates_)[0];
      gates_.for_each_derivative(length, [&](int, double w, double slope) {
        double most = 0;
        for (int c = 0; c < 3; ++c)
          most =
              std::max(most, std::abs(value[c] * (w * use.value * rates.log_f[c] + slope * use.slope * rates.length)));
        squares += most * most;
      });
    }
    for (std::size_t i = 0; i < kRates.size(); ++i)
      moments_.of[i] += squares * (1 + kRates[1] * ratio_) / (1 + kRates[i] * ratio_);
  }

 private:
  const GateSet& gates_;
  Balance balance_;
  Moments& moments_;
  std::optional<ColumnRates> rates_;
  double ratio_ = 0;
};

}  // namespace

double measure_light_rate(const Scene& scene, const GateSet& gates, EstimatorOptions options,
                          const TangentBasis* column, const Stream& stream, double paths, double& work) {
  options.mix = SamplingMix{};
  options.keep_length = false;
  const SampleRange range{
      0, std::max(1, static_cast<int>(paths / (double{1} * scene.camera.width * scene.camera.height)))};
  Moments moments;
  double work_of[2];
  for (const int i : {0, 1}) {
    options.light = kRates[i];
    const Passes passes(scene, gates, options, column, nullptr);
    if (passes.scene.emitters.empty() || (column && !passes.has(Term::interior))) return 0;
    const PassKind kind = column ? PassKind::interior : PassKind::primal;
    const int partitions = passes.partitions_for(range, kRates.size());
    moments = passes.sum_of<Moments>(kind, partitions, [&](int partition) {
      Moments own;
      MomentSink sink(passes, column, own);
      const Pass pass{stream, range};
      if (column)
        passes.run_term(Term::interior, pass, {partition, partitions}, passes.every_gate, sink);
      else
        passes.run_images(pass, {partition, partitions}, sink);
      return own;
    });
    work_of[i] = passes.work();
    work += work_of[i];
  }
  const auto cost = [&](std::size_t i) {
    return moments.of[i] * (work_of[0] + kRates[i] / kRates[1] * (work_of[1] - work_of[0]));
  };
  std::size_t best = 0;
  for (std::size_t i = 1; i < kRates.size(); ++i)
    if (cost(i) < (best == 0 ? kClearlyBetter : 1) * cost(best)) best = i;
  return kRates[best];
}

}  // namespace isochron
