#include "core/render/technique_trial.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/base/listed_sum.h"

namespace isochron {
namespace {

/// Where the sums over blocks of pixels are.
struct Layout {
  int width, block, blocks_across, gates, channels;
  std::size_t size;

  Layout(const Passes& passes, int block_size)
      : width(passes.scene.camera.width),
        block(block_size),
        blocks_across((width + block - 1) / block),
        gates(passes.gates.size()),
        channels(passes.scene.scene.grey ? 1 : 3),
        size(static_cast<std::size_t>(blocks_across) * ((passes.scene.camera.height + block - 1) / block) * gates *
             channels) {}
  std::size_t at(int pixel, int gate) const {
    const int of_block = pixel / width / block * blocks_across + pixel % width / block;
    return (static_cast<std::size_t>(of_block) * gates + gate) * channels;
  }
};

/// Sums over blocks, and behind them the magnitudes of what connections do not find and second moments of contributions, with
/// light subpaths and without.
class BlockSink final : public Sink {
 public:
  static constexpr int kOthers = 0, kMoment = 1, kMomentWithout = 2, kExtra = 3;

  /// `moments`: whether all is found by standard sampling, the part `light` of it with light subpaths.
  BlockSink(const Passes& passes, const TangentBasis* column, const Layout& layout, bool moments, double light,
            ListedSum& sums)
      : gates_(passes.gates),
        scene_(passes.scene),
        layout_(layout),
        sums_(sums),
        balance_(passes.scene, passes.every_gate),
        moments_(moments),
        light_(light) {
    if (column) rates_.emplace(passes.scene.layout, *column);
  }

  bool differential() const override { return rates_.has_value(); }
  void note_path(const Path& path) override {
    const int last = path.size() - 1;
    const auto outside = [&](int k) { return scene_.outside(path.vertex[k], path.vertex[k + 1]); };
    by_others_ = last > 1 && (!outside(last - 1) || (is_light(path.back().triangle) && !outside(last - 2)));
    if (moments_ && light_ > 0)
      without_light_ = (1 - light_) * (1 + light_rate(light_) * balance_.light_ratio(path, 0).all);
  }
  void bind(const LocalDifferential& differential) override { rates_->bind(differential); }

  void add(int pixel, const Rgb& value, double length, GateUse use) override {
    if (!rates_) {
      gates_.for_each_value(length, [&](int g, double w) { splat(pixel, g, value * w); });
    } else if (!rates_->touched().empty()) {
      const ColumnRates::Rates& rates = (*rates_)[0];
      const Rgb log_f(rates.log_f[0], rates.log_f[1], rates.log_f[2]);
      gates_.for_each_derivative(length, [&](int g, double w, double slope) {
        splat(pixel, g, value * (log_f * w + Rgb(slope_factor(use) * slope * rates.length)));
      });
    }
  }
  void add_length_rate(int pixel, int gate, const Rgb& value) override {
    if (!rates_->touched().empty()) splat(pixel, gate, value * (*rates_)[0].length);
  }

 private:
  void splat(int pixel, int gate, const Rgb& value) {
    double* out = sums_.at(layout_.at(pixel, gate), layout_.channels);
    for (int c = 0; c < layout_.channels; ++c) out[c] += value[c];
    const double magnitude = std::max({std::abs(value.r), std::abs(value.g), std::abs(value.b)});
    if (by_others_) *sums_.at(layout_.size + kOthers, 1) += magnitude;
    if (!moments_) return;
    double* moments = sums_.at(layout_.size + kMoment, 2);
    moments[0] += magnitude * magnitude;
    moments[1] += magnitude * magnitude * without_light_;
  }

  const GateSet& gates_;
  const PreparedScene& scene_;
  const Layout& layout_;
  ListedSum& sums_;
  std::optional<ColumnRates> rates_;
  bool by_others_ = false;
  Balance balance_;
  const bool moments_;
  const double light_;
  double without_light_ = 1;
};

}  // namespace

TrialBatches run_trial(const TechniqueTrial& trial, PathMix mix, Term term, int batches, const Stream& stream,
                       SceneCache& cache) {
  EstimatorOptions options = trial.options;
  options.mix = mix.sampling_mix();
  options.light.reset();
  const Passes passes(trial.scene, trial.gates, options, trial.column, &cache);
  TrialBatches result;
  if (passes.scene.emitters.empty() || (trial.column && !passes.has(term))) return result;
  if (trial.column) passes.prepare(term);
  result.learning = passes.work();
  const PassKind kind = trial.column ? pass_kind(term) : PassKind::primal;
  const bool moments = !mix.connections && (!trial.column || term == Term::interior);
  const Layout layout(passes, trial.block);
  ListedSum sums(layout.size), squares(layout.size);
  for (; result.count < batches; ++result.count) {
    const SampleRange range{result.count * trial.samples, (result.count + 1) * trial.samples};
    const int partitions = passes.partitions_for(range, layout.size);
    const auto found = passes.sum_of<ListedSum>(kind, partitions, [&](int partition) {
      ListedSum own(layout.size + BlockSink::kExtra);
      BlockSink sink(passes, trial.column, layout, moments, mix.light, own);
      const Pass pass{stream, range};
      if (trial.column)
        passes.run_term(term, pass, {partition, partitions}, passes.every_gate, sink);
      else
        passes.run_images(pass, {partition, partitions}, sink);
      own.finish();
      return own;
    });
    found.for_each(0, layout.size, [&](std::size_t i, double value) {
      *sums.at(i, 1) += value;
      *squares.at(i, 1) += value * value;
    });
    found.for_each(layout.size, found.size(), [&](std::size_t i, double value) {
      if (i == layout.size + BlockSink::kOthers)
        result.has_others |= value > 0;
      else
        (i == layout.size + BlockSink::kMoment ? result.moment : result.moment_without_light) += value;
    });
  }
  result.work = (passes.work() - result.learning) / (result.count * trial.samples);
  for (double* moment : {&result.moment, &result.moment_without_light})
    *moment *= trial.samples / static_cast<double>(result.count);
  sums.finish();
  squares.finish();
  if (result.count < 2) return result;
  double variance = 0;
  squares.for_each(0, layout.size, [&](std::size_t, double value) { variance += value; });
  sums.for_each(0, layout.size, [&](std::size_t, double value) { variance -= value * value / result.count; });
  result.variance = variance / (result.count - 1) * trial.samples;
  return result;
}

}  // namespace isochron
