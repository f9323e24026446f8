#include "optim/estimates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/math/error.h"

namespace isochron {
namespace {

int batches_for(const char* term, int samples) {
  if (samples < 2)
    throw InputError(fmt::format("samples.{}: {} is too few for a standard error (allowed: at least 2{})", term,
                                 samples, std::string_view(term) == "primal" ? "" : ", or 0 to leave the term out"));
  return std::min(kMostBatches, samples);
}

std::vector<double> gate_means(const GatedImage& image) {
  std::vector<double> means;
  for (int g = 0; g < image.gates; ++g) means.push_back(image.mean(g));
  return means;
}

/// Means and batch statistics of the images that `estimate(range)` gives, `count` at a time.
template <class Estimate>
DerivativeEstimate collect(const std::string& component, int samples, int batches, int count, const Poll& poll,
                           Estimate&& estimate) {
  std::vector<ImageMean> means(count);
  std::vector<BatchStatistics> statistics(count);
  ProgressStage stage("rendering the " + component, batches);
  for (int b = 0; b < batches; ++b) {
    const SampleRange range = Share{b, batches}.of(samples);
    const std::vector<GatedImage> images = estimate(range);
    for (int i = 0; i < count; ++i) {
      means[i].add(images[i], range.count());
      statistics[i].add(gate_means(images[i]), range.count());
    }
    stage.advance();
    poll();
  }
  DerivativeEstimate result{component, {}, {}};
  for (int i = 0; i < count; ++i) {
    result.images.push_back(means[i].mean());
    result.gates.push_back(statistics[i].result());
  }
  return result;
}

/// Sum of the terms, whose random numbers are independent: variances add.
DerivativeEstimate sum_of(const std::vector<DerivativeEstimate>& terms) {
  DerivativeEstimate total = terms.front();
  total.component = "total";
  for (std::size_t i = 0; i < total.images.size(); ++i) {
    for (std::size_t t = 1; t < terms.size(); ++t) {
      const GatedImage& image = terms[t].images[i];
      for (std::size_t k = 0; k < image.data.size(); ++k) total.images[i].data[k] += image.data[k];
      for (std::size_t g = 0; g < total.gates[i].mean.size(); ++g) {
        total.gates[i].mean[g] += terms[t].gates[i].mean[g];
      }
    }
    for (std::size_t g = 0; g < total.gates[i].mean.size(); ++g) {
      double error = 0, fourth = 0;
      for (const DerivativeEstimate& term : terms) error = std::hypot(error, term.gates[i].standard_error[g]);
      total.gates[i].standard_error[g] = error;
      if (!(error > 0)) continue;
      // So do fourth cumulants, (kurtosis - 3) variance^2.
      for (const DerivativeEstimate& term : terms) {
        const double share = term.gates[i].standard_error[g] / error;
        fourth += (term.gates[i].kurtosis[g] - 3) * std::pow(share, 4);
      }
      total.gates[i].kurtosis[g] = 3 + fourth;
    }
  }
  return total;
}

}  // namespace

void BatchStatistics::add(const std::vector<double>& batch, int samples) {
  batches_.push_back(batch);
  samples_.push_back(samples);
}

Statistics BatchStatistics::result() const {
  const std::size_t count = batches_.size(), size = batches_.front().size();
  double samples = 0;
  for (double n : samples_) samples += n;
  const auto n = static_cast<double>(count);
  const std::vector<double> zeros(size, 0.0);
  Statistics result{zeros, zeros, zeros};
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t b = 0; b < count; ++b) result.mean[i] += samples_[b] / samples * batches_[b][i];
    const auto deviation = [&](std::size_t b) { return samples_[b] / samples * (batches_[b][i] - result.mean[i]); };
    double sum = 0;
    for (std::size_t b = 0; b < count; ++b) sum += deviation(b) * deviation(b);
    result.standard_error[i] = std::sqrt(sum * n / (n - 1));
    if (!(sum > 0)) continue;
    for (std::size_t b = 0; b < count; ++b) {
      const double share = deviation(b) * deviation(b) / sum;
      result.kurtosis[i] += n * share * share;
    }
  }
  return result;
}

ImageEstimate estimate_image(const Problem& problem, const std::vector<double>& theta, const Poll& poll) {
  const int samples = problem.experiment().samples.primal;
  const int batches = batches_for("primal", samples);
  const Scene scene = problem.parameters().apply(theta);
  const Renderer renderer(scene, problem.gates(), problem.estimator());
  const Stream stream = problem.stream(Pass::primal);
  DerivativeEstimate result = collect("image", samples, batches, 1, poll, [&](SampleRange range) {
    return std::vector<GatedImage>{renderer.render(stream, range)};
  });
  return {std::move(result.images[0]), std::move(result.gates[0])};
}

std::vector<DerivativeEstimate> estimate_derivatives(const Problem& problem, const std::vector<double>& theta,
                                                     int first, int count, const Poll& poll) {
  const SampleSpec& spec = problem.experiment().samples;
  if (problem.experiment().gradient.method == GradientMethod::finite_difference) {
    const Stream stream = problem.stream(Pass::finite_difference);
    return {collect("total", spec.primal, batches_for("primal", spec.primal), count, poll, [&](SampleRange range) {
      std::vector<GatedImage> images;
      for (int i = first; i < first + count; ++i) images.push_back(problem.finite_difference(theta, i, stream, range));
      return images;
    })};
  }
  for (Term term : kTerms)
    if (spec.term(term) > 0) batches_for(name(term), spec.term(term));  // before anything is rendered
  const Scene scene = problem.parameters().apply(theta);
  const TangentBasis basis = select_columns(problem.parameters().tangent(theta), first, count);
  const Renderer renderer(scene, problem.gates(), problem.estimator(spec.visibility, Purpose::images), &basis);
  std::vector<DerivativeEstimate> components;
  const auto terms = std::count_if(std::begin(kTerms), std::end(kTerms), [&](Term t) { return spec.term(t) > 0; });
  ProgressStage stage("rendering the derivatives", static_cast<int>(terms));
  for (Term term : kTerms) {
    const int samples = spec.term(term);
    if (samples == 0) continue;
    const Stream stream = problem.stream(pass_of(term));
    components.push_back(collect(name(term), samples, batches_for(name(term), samples), count, poll,
                                 [&](SampleRange range) { return renderer.derive(term, stream, range); }));
    stage.advance();
  }
  if (components.empty()) throw InputError("samples: every term of the derivative is left out (one above 0)");
  components.insert(components.begin(), sum_of(components));
  return components;
}

int gradient_repeats(const Problem& problem) {
  const SampleSpec& spec = problem.experiment().samples;
  int repeats = batches_for("primal", spec.primal);
  if (problem.experiment().gradient.method == GradientMethod::finite_difference) return repeats;
  for (Term term : kTerms)
    if (spec.term(term) > 0) repeats = std::min(repeats, batches_for(name(term), spec.term(term)));
  return repeats;
}

GradientEstimate estimate_gradient(const Problem& problem, const std::vector<double>& theta, const GatedImage& target,
                                   const Poll& poll) {
  GradientEstimate result;
  result.repeats = gradient_repeats(problem);
  BatchStatistics statistics;
  ProgressStage stage("estimating the gradient", result.repeats);
  for (int r = 0; r < result.repeats; ++r) {
    statistics.add(problem.evaluate(theta, target, 0, poll, {r, result.repeats}).gradient, 1);
    stage.advance();
  }
  result.gradient = statistics.result();
  return result;
}

}  // namespace isochron
