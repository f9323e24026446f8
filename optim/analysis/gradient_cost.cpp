#include "optim/analysis/gradient_cost.h"

#include <algorithm>
#include <cmath>

#include "core/base/cpu_time.h"
#include "optim/analysis/inspection.h"
#include "optim/problem/estimates.h"
#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

constexpr int kImages = 16, kBatches = 32, kTimings = 3;
/// Time of a pass that serves all images at once, over that of a plain one; about.
constexpr double kBreakdownTime = 2;
constexpr int kFirstIndex = 1 << 20;  ///< of random streams

Stream stream_of(const Problem& problem, Pass pass, int index) {
  return inspection_stream(problem, pass, kFirstIndex + index);
}

/// CPU seconds of one evaluation as the optimiser has it, with everything that is rebuilt: first the
/// overhead, then the passes.
using Times = std::array<double, 1 + kPasses>;

Times time_evaluation(const Problem& problem, const std::vector<double>& theta, const GatedImage& target,
                      const std::array<bool, 3>& kept, const std::array<int, kPasses>& samples, int index) {
  Times times{};
  double last = cpu_seconds();
  const auto lap = [&](int what) {
    const double now = cpu_seconds();
    times[what] = now - last;
    last = now;
  };
  const Scene scene = problem.parameters().apply(theta);
  const TangentBasis basis = problem.parameters().tangent(theta);
  const Renderer renderer(scene, problem.gates(), problem.estimator(samples[2]), &basis);
  lap(0);
  const SplitImage image = render_halves(renderer, stream_of(problem, Pass::primal, index), {0, samples[0]});
  const GatedImage adjoint = loss_adjoint(image, target, problem.reading_loss(target));
  lap(1);
  std::vector<double> dof_gradient(DofLayout(scene).size(), 0.0);
  for (int t = 0; t < 3; ++t) {
    if (!kept[t]) continue;
    renderer.add_gradient(kTerms[t], adjoint, stream_of(problem, pass_of(kTerms[t]), index), {0, samples[1 + t]},
                          dof_gradient);
    lap(2 + t);
  }
  return times;
}

/// Gradients of every image's residual with every batch of every term. Adds up the variance by its causes.
class VarianceCollector {
 public:
  VarianceCollector(int columns, const std::array<int, kPasses>& samples)
      : samples_(samples),
        by_image_(columns, std::vector<double>(kImages, 0.0)),
        by_batch_(kBatches, std::vector<double>(columns, 0.0)) {}

  /// tables: [column][image][batch].
  void add_term(int term, const std::vector<std::vector<std::vector<double>>>& tables) {
    const double images = samples_[0], own = samples_[1 + term];
    for (std::size_t c = 0; c < tables.size(); ++c) {
      const VarianceComponents v = variance_components(tables[c]);
      variance_.term[term] += v.columns * own;
      variance_.cross[term] += v.cells * images * own;
      of_batches_ += v.cells / kBatches;
      for (int i = 0; i < kImages; ++i) {
        by_image_[c][i] += mean(tables[c][i]);
        for (int b = 0; b < kBatches; ++b) by_batch_[b][c] += tables[c][i][b] / kImages;
      }
    }
  }

  /// Components that come out below zero, by noise, count as zero.
  GradientVariance variance() const {
    double of_images = -of_batches_;
    for (const auto& row : by_image_)
      for (double x : row) of_images += (x - mean(row)) * (x - mean(row)) / (kImages - 1);
    GradientVariance result = variance_;
    result.image = std::max(0.0, of_images * samples_[0]);
    for (double& v : result.term) v = std::max(0.0, v);
    return result;
  }
  /// As if the batches' squared distances from their mean were those of one number.
  double effective_count() const {
    std::vector<double> center(by_image_.size(), 0.0), squares(kBatches, 0.0);
    for (const auto& batch : by_batch_)
      for (std::size_t c = 0; c < center.size(); ++c) center[c] += batch[c] / kBatches;
    for (int b = 0; b < kBatches; ++b)
      for (std::size_t c = 0; c < center.size(); ++c)
        squares[b] += (by_batch_[b][c] - center[c]) * (by_batch_[b][c] - center[c]);
    const double all = mean(squares) * kBatches;
    double sum = 0;
    for (double s : squares) sum += all > 0 ? (s / all) * (s / all) : 0;
    return (1 - 1.0 / kBatches) / sum;
  }

 private:
  const std::array<int, kPasses> samples_;
  GradientVariance variance_;
  std::vector<std::vector<double>> by_image_;  ///< [column][image]: means over batches, summed over terms
  std::vector<std::vector<double>> by_batch_;  ///< [batch][column]: means over images, summed over terms
  double of_batches_ = 0;                      ///< variance of by_image_ that is the batches'
};

}  // namespace

std::array<int, kPasses> affordable_samples(const Problem& problem, const std::vector<double>& theta,
                                            const GatedImage& target, const std::array<bool, 3>& kept, double seconds) {
  const SampleSpec& spec = problem.experiment().samples;
  const std::array<int, kPasses> all{spec.primal, spec.interior, spec.visibility, spec.path_length};
  const auto scaled = [&](double factor) {
    std::array<int, kPasses> n;
    for (int i = 0; i < kPasses; ++i) n[i] = std::max(i == 0 ? 2 : 1, static_cast<int>(std::lround(factor * all[i])));
    return n;
  };
  const std::array<int, kPasses> few = scaled(0.125);
  const Times times = time_evaluation(problem, theta, target, kept, few, 0);
  double whole = 0;  // of measure_cost with all samples
  for (int i = 0; i < kPasses; ++i) {
    const double repeats = kTimings + (i == 0 ? kImages : kBreakdownTime * kBatches);
    whole += times[1 + i] * std::max(all[i], 1) / few[i] * repeats;
  }
  return scaled(std::min(1.0, seconds / whole));
}

GradientCost measure_cost(const Problem& problem, const std::vector<double>& theta, const GatedImage& target,
                          const std::array<bool, 3>& kept, const std::array<int, kPasses>& samples) {
  GradientCost result;
  std::vector<Times> times;
  for (int i = 0; i < kTimings; ++i) {
    times.push_back(time_evaluation(problem, theta, target, kept, samples, i));
  }
  const auto median_time = [&](int what) {
    std::vector<double> values;
    for (const Times& t : times) values.push_back(t[what]);
    return median(values);
  };
  const double pixels = problem.scene().camera.width * problem.scene().camera.height;
  result.overhead = median_time(0);
  for (int i = 0; i < kPasses; ++i) result.seconds[i] = median_time(1 + i) / samples[i] / pixels;

  const Scene scene = problem.parameters().apply(theta);
  const TangentBasis basis = problem.parameters().tangent(theta);
  const int visibility = problem.experiment().samples.visibility;
  const Renderer renderer(scene, problem.gates(), problem.estimator(visibility), &basis);
  const ReadingLoss robust = problem.reading_loss(target);
  std::vector<GatedImage> adjoints;
  for (int i = 0; i < kImages; ++i) {
    const SplitImage image = render_halves(renderer, stream_of(problem, Pass::primal, i), {0, samples[0]});
    adjoints.push_back(loss_adjoint(image, target, robust));
  }
  const std::vector<double> unit = comparable_units(problem.parameters());
  const int columns = problem.parameters().size();
  VarianceCollector collector(columns, samples);
  for (int t = 0; t < 3; ++t) {
    if (!kept[t]) continue;
    std::vector<std::vector<std::vector<double>>> tables(
        columns, std::vector<std::vector<double>>(kImages, std::vector<double>(kBatches, 0.0)));
    for (int b = 0; b < kBatches; ++b) {
      const GradientBreakdown breakdown = renderer.gradient_breakdown(
          kTerms[t], adjoints, stream_of(problem, pass_of(kTerms[t]), b), {0, samples[1 + t]});
      for (std::size_t i = 0; i < breakdown.by_bounces.size(); ++i) {
        const std::size_t column = i / kImages % columns;
        tables[column][i % kImages][b] += unit[column] * breakdown.by_bounces[i];
      }
    }
    collector.add_term(t, tables);
  }
  result.variance = collector.variance();
  result.effective_count = collector.effective_count();
  return result;
}

}  // namespace isochron
