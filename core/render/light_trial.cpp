#include "core/render/light_trial.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace isochron {
namespace {

/// The cost with light subpaths over that without must be below this, for images and for derivatives. Of a gradient the interior term
/// is a part: its other terms keep their noise and it takes longer, as rays do not count the differential of every joint. In the
/// corridor the trial's ratio is 0.20 to 0.28 over five seeds, but the gradient costs less without light subpaths (`chart
/// --techniques`); in the cove, where it costs ten times as much, it is 0.03 to 0.16.
constexpr double kMaxCostRatio[] = {0.8, 0.18};

/// Second moments of what samples find, without and with light subpaths.
struct Moments {
  std::array<double, 2> of{};
  void add(const Moments& other) {
    for (std::size_t i = 0; i < of.size(); ++i) of[i] += other.of[i];
  }
  void pack(Packer& packer) const { packer.put(of); }
  void unpack(Unpacker& unpacker) { unpacker.get(of); }
};

/// A contribution v = f / (n_s p_s + n_l p_l) is the same whichever technique found it, so that the sum of v g over all that is
/// found is the integral of f g; with g = f / p_s the second moment of standard sampling alone.
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
  void add(int, const Rgb& value, double length, GateUse use) override {
    double squares = 0;
    if (!rates_) {
      gates_.for_each_value(length, [&](int, double w) { squares += w * w; });
      squares *= value.max() * value.max();
    } else if (!rates_->touched().empty()) {
      const ColumnRates::Rates& rates = (*rates_)[0];
      gates_.for_each_derivative(length, [&](int, double w, double slope) {
        double most = 0;
        for (int c = 0; c < 3; ++c)
          most = std::max(most, std::abs(value[c] * (w * rates.log_f[c] + slope_factor(use) * slope * rates.length)));
        squares += most * most;
      });
    }
    // Of as many standard samples alone.
    moments_.of[0] += squares * (1 + light_rate(kLightShare) * ratio_);
    moments_.of[1] += squares;
  }

 private:
  const GateSet& gates_;
  Balance balance_;
  Moments& moments_;
  std::optional<ColumnRates> rates_;
  double ratio_ = 0;
};

}  // namespace

bool light_subpaths_pay(const Scene& scene, const GateSet& gates, EstimatorOptions options, const TangentBasis* column,
                        const Stream& stream, double paths, double& work) {
  options.mix = SamplingMix{};
  options.keep_length = false;
  const SampleRange range{
      0, std::max(1, static_cast<int>(paths / (double{1} * scene.camera.width * scene.camera.height)))};
  Moments moments;
  double work_of[2];
  SceneCache cache(scene, CasterUpdate::rebuild);
  for (const int i : {0, 1}) {
    options.light = i * kLightShare;
    const Passes passes(scene, gates, options, column, &cache);
    if (passes.scene.emitters.empty() || (column && !passes.has(Term::interior))) return false;
    const PassKind kind = column ? PassKind::interior : PassKind::primal;
    const int partitions = passes.partitions_for(range, 2);
    moments = passes.sum_of<Moments>(kind, partitions, [&](int partition) {
      Moments own;
      MomentSink sink(passes, column, own);
      passes.run_images_or_interior({stream, range}, {partition, partitions}, sink);
      return own;
    });
    work_of[i] = passes.work();
    work += work_of[i];
  }
  // Of as many samples, of which the others are standard.
  const double cost = moments.of[1] / (1 - kLightShare) * work_of[1], without = moments.of[0] * work_of[0];
  return cost < kMaxCostRatio[column != nullptr] * without;
}

}  // namespace isochron
