#include "core/render/share_trial.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/listed_sum.h"

namespace isochron {
namespace {

constexpr double kConnectionTrialShare = 0.5;
constexpr std::size_t kShareCount = kConnectionShares.size();
/// By what low-discrepancy numbers lower the variance of pixels under standard sampling, where trials do without: about 2 on the
/// cube, 0.8 in the Cornell box (isochron_share_trial: costs of trials against those of 64 samples).
constexpr double kGainOfStandard = 1.3;

/// Where the images are that a trial adds up: by share and kind of samples, each of sums over blocks of pixels.
struct Layout {
  int width, block, blocks_across, gates, channels;
  std::size_t size;  ///< of one image

  Layout(const Passes& passes, int block_size)
      : width(passes.scene.camera.width),
        block(block_size),
        blocks_across((width + block - 1) / block),
        gates(passes.gates.size()),
        channels(passes.scene.scene.grey ? 1 : 3),
        size(static_cast<std::size_t>(blocks_across) * ((passes.scene.camera.height + block - 1) / block) * gates *
             channels) {}
  static std::size_t image(std::size_t share, bool connections) { return 2 * share + connections; }
  std::size_t total() const { return 2 * kShareCount * size; }
  std::size_t at(std::size_t image, int pixel, int gate) const {
    const int of_block = pixel / width / block * blocks_across + pixel % width / block;
    return image * size + (static_cast<std::size_t>(of_block) * gates + gate) * channels;
  }
};

/// The images of every share by connections and by all other samples, for as many samples of each as the trial has.
class ShareSink final : public Sink {
 public:
  ShareSink(const Passes& passes, const TangentBasis* column, const Layout& layout, ListedSum& sums)
      : gates_(passes.gates),
        balance_(passes.scene, passes.every_gate),
        gain_(column ? passes.slope_gain() : 1),
        layout_(layout),
        sums_(sums) {
    balance_.rates.light = light_rate(column ? passes.mix.interior_light : passes.mix.image_light);
    if (column) rates_.emplace(passes.scene.layout, *column);
  }

  bool differential() const override { return rates_.has_value(); }
  void note_technique(Technique t) override { by_connections_ = is_connection(t); }
  void note_path(const Path& path) override { ratio_ = balance_.connection_ratio(path, 0); }
  void bind(const LocalDifferential& differential) override { rates_->bind(differential); }

  void add(int pixel, const Rgb& value, double length, GateWeights use) override {
    const Factors of_value(ratio_), of_slope(by_connections_ ? ratio_ : gain_ * ratio_);
    if (!rates_) {
      gates_.for_each_value(length, [&](int g, double w) { splat(pixel, g, value * (w * use.value), of_value); });
    } else if (!rates_->touched().empty()) {
      const ColumnRates::Rates& rates = (*rates_)[0];
      gates_.for_each_derivative(length, [&](int g, double w, double slope) {
        const Rgb log_f(rates.log_f[0], rates.log_f[1], rates.log_f[2]);
        splat(pixel, g, value * log_f * (w * use.value), of_value);
        if (use.slope != 0) splat(pixel, g, value * (slope * use.slope * rates.length), of_slope);
      });
    }
  }
  void add_length_rate(int pixel, int gate, const Rgb& value) override {
    if (!rates_->touched().empty()) splat(pixel, gate, value * (*rates_)[0].length, Factors(gain_ * ratio_));
  }

 private:
  /// By what the weight of a contribution over the number of samples changes, by share. `ratio`: Balance::connection_ratio.
  struct Factors : std::array<double, kShareCount> {
    explicit Factors(double ratio) {
      // Density of the path under all samples, over that under others, or, where only connections find it, under those.
      const auto density = [&](double share) { return std::isinf(ratio) ? share : 1 - share + share * ratio; };
      const double here = density(kConnectionTrialShare);
      for (std::size_t k = 0; k < kShareCount; ++k) {
        const double there = density(kConnectionShares[k]);
        (*this)[k] = there > 0 ? here / there : ratio > 0 ? 0 : 1;
      }
    }
  };

  void splat(int pixel, int gate, const Rgb& value, const Factors& factors) {
    for (std::size_t k = 0; k < kShareCount; ++k) {
      // What connections do not find is missing where they are alone: the image in its place tells that there is any.
      if (kConnectionShares[k] == (by_connections_ ? 0 : 1) && (by_connections_ || ratio_ > 0)) continue;
      double* out = sums_.at(layout_.at(Layout::image(k, by_connections_), pixel, gate), layout_.channels);
      for (int c = 0; c < layout_.channels; ++c) out[c] += value[c] * factors[k];
    }
  }

  const GateSet& gates_;
  Balance balance_;
  const double gain_;
  const Layout& layout_;
  ListedSum& sums_;
  std::optional<ColumnRates> rates_;
  bool by_connections_ = false;
  double ratio_ = 0;
};

}  // namespace

ShareCosts measure_shares(const ShareTrial& trial, const Stream& stream, double& work) {
  EstimatorOptions options = trial.options;
  options.mix = SamplingMix{.image = kConnectionTrialShare, .interior = kConnectionTrialShare};
  // Where paths keep their lengths, a part of the variance is another term's.
  options.keep_length = false;
  // What low-discrepancy numbers gain in a pixel grows with its samples, of which trials have few. In sums, techniques whose
  // points cover the whole image gain as much in a trial (isochron_share_trial: cube, 5 %, sums).
  if (trial.block == 1) options.numbers = Numbers::independent;
  const Passes passes(trial.scene, trial.gates, options, trial.column, nullptr);
  if (passes.scene.emitters.empty() || (trial.column && !passes.has(Term::interior))) return {{}, 0};
  const Layout layout(passes, trial.block);
  ListedSum sums(layout.total()), squares(layout.total());
  int batches = 0;
  double all = 0, of_connections = 0, of_others = 0, affordable = 0;  // work, and batches
  for (bool goes_on = true; goes_on;) {
    const SampleRange range{batches * trial.samples, (batches + 1) * trial.samples};
    const Pass pass{stream, range};
    const int partitions = passes.partitions_for(range, layout.total());
    const auto kind = trial.column ? PassKind::interior : PassKind::primal;
    const auto sum = passes.sum_of<ListedSum>(kind, partitions, [&](int partition) {
      ListedSum own(layout.total());
      ShareSink sink(passes, trial.column, layout, own);
      passes.run_images_or_interior(pass, {partition, partitions}, sink);
      own.finish();
      return own;
    });
    sum.for_each(0, layout.total(), [&](std::size_t i, double value) {
      *sums.at(i, 1) += value;
      *squares.at(i, 1) += value * value;
    });
    ++batches;
    all = passes.work(), of_connections = 0;
    for (const Technique t : {Technique::walk, Technique::camera_lengths, Technique::camera_pairs})
      of_connections += passes.work_of(t);
    of_others = all - of_connections;
    // Half of the samples are of the cheaper kind.
    const double of_sample =
        2 * std::min(of_connections, of_others) / (double{1} * passes.scene.camera.pixels() * range.end);
    affordable = trial.most_samples * of_sample * batches / all;
    goes_on = batches < trial.batches && batches + 1 <= affordable;
  }
  work += all;
  if (batches < 2) return {{}, affordable};
  sums.finish();
  squares.finish();
  std::array<double, kShareCount> cost;
  for (std::size_t k = 0; k < kShareCount; ++k) {
    double variance = 0, of_share = 0;
    for (const bool connections : {false, true}) {
      // As many samples as in the trial, times this.
      const double number = connections ? kConnectionShares[k] / kConnectionTrialShare
                                        : (1 - kConnectionShares[k]) / (1 - kConnectionTrialShare);
      const std::size_t begin = Layout::image(k, connections) * layout.size, end = begin + layout.size;
      double own = 0;
      squares.for_each(begin, end, [&](std::size_t, double value) { own += value; });
      sums.for_each(begin, end, [&](std::size_t, double value) { own -= value * value / batches; });
      variance += number * own / (batches - 1);
      of_share += number * (connections ? of_connections : of_others) / batches;
    }
    // Nothing seen says nothing: a technique that never hit the gates is no good one.
    cost[k] = variance > 0 ? variance * of_share : std::numeric_limits<double>::infinity();
  }
  bool any_left_out = false;
  const std::size_t left_out = Layout::image(kShareCount - 1, false) * layout.size;
  squares.for_each(left_out, left_out + layout.size, [&](std::size_t, double value) { any_left_out |= value > 0; });
  if (any_left_out) cost.back() = std::numeric_limits<double>::infinity();
  if (trial.block == 1 && trial.options.numbers == Numbers::low_discrepancy) cost[0] /= kGainOfStandard;
  return {cost, affordable};
}

}  // namespace isochron
