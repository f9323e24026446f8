#include "optim/problem/estimates.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace isochron {
namespace {

/// Throws InputError where they are too few for a standard error.
void require_replicates(const char* term, int samples) {
  if (samples < 2)
    throw InputError(fmt::format("samples.{}: {} is too few for a standard error (allowed: at least 2{})", term,
                                 samples, std::string_view(term) == "primal" ? "" : ", or 0 to leave the term out"));
}

/// Means and statistics of the images that `render` makes of so many replicates, each from a part of the samples.
template <class Render>
DerivativeEstimate collect(const std::string& component, int samples, int replicates, bool pixels_are_independent,
                           Render&& render) {
  std::vector<SampleRange> ranges;
  for (int r = 0; r < replicates; ++r) ranges.push_back(Share{r, replicates}.of(samples));
  const ProgressStage stage("rendering the " + component, 1);
  DerivativeEstimate result{component, {}, {}};
  for (ReplicatedImage& image : render(ranges)) {
    result.gates.push_back(gate_statistics(image.gates, image.mean.pixels(), pixels_are_independent));
    result.images.push_back(std::move(image.mean));
  }
  return result;
}

/// The same of `count` images that estimate(range) makes one replicate of.
template <class Estimate>
DerivativeEstimate collect_whole(const std::string& component, int samples, int replicates, bool pixels_are_independent,
                                 int count, Estimate&& estimate) {
  std::vector<ImageStatistics> statistics(count, ImageStatistics(pixels_are_independent));
  ProgressStage stage("rendering the " + component, replicates);
  for (int r = 0; r < replicates; ++r) {
    const SampleRange range = Share{r, replicates}.of(samples);
    std::vector<GatedImage> images = estimate(range);
    for (int i = 0; i < count; ++i) statistics[i].add(std::move(images[i]), range.count());
    stage.advance();
  }
  DerivativeEstimate result{component, {}, {}};
  for (ImageStatistics& of_image : statistics) {
    result.images.emplace_back(of_image.mean());
    result.gates.push_back(of_image.gates());
    of_image = ImageStatistics(pixels_are_independent);  // its images are no longer needed
  }
  return result;
}

/// Sum of the terms, whose random numbers are independent.
DerivativeEstimate total_of(const std::vector<DerivativeEstimate>& terms) {
  DerivativeEstimate total = terms.front();
  total.component = "total";
  for (std::size_t i = 0; i < total.images.size(); ++i) {
    std::vector<const Statistics*> of_terms;
    for (const DerivativeEstimate& term : terms) of_terms.push_back(&term.gates[i]);
    total.gates[i] = sum_of(of_terms);
    StoredImage& image = total.images[i];
    RowSum sum(image.values_of_pixel());
    std::vector<StoredImage::Entry> entries;
    for (int pixel = 0; terms.size() > 1 && pixel < image.pixels(); ++pixel) {
      for (const DerivativeEstimate& term : terms)
        term.images[i].for_each(pixel, [&](std::uint32_t place, float value) { sum.add(place, value); });
      entries.clear();
      sum.take([&](std::uint32_t place, double value) { entries.push_back({place, static_cast<float>(value)}); });
      image.set(pixel, entries);
    }
  }
  return total;
}

int pixels_of(const Problem& problem) {
  return problem.scene().camera.width * problem.scene().camera.height;
}

/// Only `total`, from so many images that `difference(stream, range)` makes.
template <class Difference>
std::vector<DerivativeEstimate> differences(const Problem& problem, int count, std::uint32_t iteration,
                                            int most_replicates, Difference&& difference) {
  const int samples = problem.experiment().samples.primal;
  require_replicates("primal", samples);
  const Stream stream = problem.stream(Pass::finite_difference, iteration);
  const bool independent = sampling_mix(problem.estimator(), problem.gates(), problem.scene()).image_stays_in_pixels();
  const int replicates = replicate_count(samples, pixels_of(problem), independent, most_replicates);
  return {collect_whole("total", samples, replicates, independent, count,
                        [&](SampleRange range) { return difference(stream, range); })};
}

/// Along each column of the basis.
std::vector<DerivativeEstimate> derivatives(const Problem& problem, const std::vector<double>& theta,
                                            const TangentBasis& basis, std::uint32_t iteration, int most_replicates) {
  const SampleSpec& spec = problem.experiment().samples;
  for (Term term : kTerms)
    if (spec.term(term) > 0) require_replicates(name(term), spec.term(term));  // before anything is rendered
  const Scene scene = problem.parameters().apply(theta);
  const Renderer renderer = problem.renderer(scene, problem.estimator(spec.visibility, Purpose::images), &basis);
  std::vector<DerivativeEstimate> components;
  const auto terms = std::count_if(std::begin(kTerms), std::end(kTerms), [&](Term t) { return spec.term(t) > 0; });
  ProgressStage stage("rendering the derivatives", static_cast<int>(terms));
  for (Term term : kTerms) {
    const int samples = spec.term(term);
    if (samples == 0) continue;
    const Stream stream = problem.stream(pass_of(term), iteration);
    const bool independent = renderer.pixels_are_independent(term);
    const int replicates = replicate_count(samples, pixels_of(problem), independent, most_replicates);
    components.push_back(collect(
        name(term), samples, replicates, independent,
        [&](const std::vector<SampleRange>& ranges) { return renderer.derive_replicates(term, stream, ranges); }));
    stage.advance();
  }
  if (components.empty()) throw InputError("samples: every term of the derivative is left out (one above 0)");
  components.insert(components.begin(), total_of(components));
  return components;
}

}  // namespace

ImageEstimate estimate_image(const Problem& problem, const std::vector<double>& theta, std::uint32_t iteration) {
  const int samples = problem.experiment().samples.primal;
  require_replicates("primal", samples);
  const Scene scene = problem.parameters().apply(theta);
  const Renderer renderer = problem.renderer(scene, problem.image_estimator());
  const Stream stream = problem.stream(Pass::render, iteration);
  const bool independent = renderer.pixels_are_independent();
  const int replicates = replicate_count(samples, pixels_of(problem), independent, kMostReplicates);
  DerivativeEstimate result =
      collect("image", samples, replicates, independent, [&](const std::vector<SampleRange>& ranges) {
        std::vector<ReplicatedImage> images;
        images.push_back(renderer.render_replicates(stream, ranges));
        return images;
      });
  return {std::move(result.images[0]), std::move(result.gates[0])};
}

std::vector<DerivativeEstimate> estimate_derivatives(const Problem& problem, const std::vector<double>& theta,
                                                     int first, int count, int most_replicates) {
  if (problem.by_differences())
    return differences(problem, count, 0, most_replicates, [&](const Stream& stream, SampleRange range) {
      std::vector<GatedImage> images;
      for (int i = first; i < first + count; ++i) images.push_back(problem.finite_difference(theta, i, stream, range));
      return images;
    });
  return derivatives(problem, theta, select_columns(problem.parameters().tangent(theta), first, count), 0,
                     most_replicates);
}

std::vector<DerivativeEstimate> estimate_tangent(const Problem& problem, const std::vector<double>& theta,
                                                 const std::vector<double>& tangent, std::uint32_t iteration) {
  if (problem.by_differences())
    return differences(problem, 1, iteration, kMostReplicates, [&](const Stream& stream, SampleRange range) {
      GatedImage sum = problem.blank();
      for (int i = 0; i < problem.parameters().size(); ++i) {
        if (tangent[i] == 0) continue;
        const GatedImage along = problem.finite_difference(theta, i, stream, range);
        for (std::size_t k = 0; k < sum.data.size(); ++k) sum.data[k] += tangent[i] * along.data[k];
      }
      return std::vector<GatedImage>{std::move(sum)};
    });
  return derivatives(problem, theta, problem.parameters().tangent(theta).combined(tangent), iteration, kMostReplicates);
}

int gradient_repeats(const Problem& problem) {
  const SampleSpec& spec = problem.experiment().samples;
  const int pixels = pixels_of(problem);
  require_replicates("primal", spec.primal);
  int samples = spec.primal;
  if (problem.experiment().loss.kind == LossKind::poisson) {  // each replicate needs two halves of its own
    if (samples < 4)
      throw InputError(
          fmt::format("samples.primal: {} is too few for a standard error under `loss: {{kind: poisson}}` "
                      "(allowed: at least 4)",
                      samples));
    samples /= 2;
  }
  int repeats = replicate_count(samples, pixels, false, kMostReplicates);
  if (problem.by_differences()) return repeats;
  for (Term term : kTerms) {
    if (spec.term(term) == 0) continue;
    require_replicates(name(term), spec.term(term));
    repeats = std::min(repeats, replicate_count(spec.term(term), pixels, false, kMostReplicates));
  }
  return repeats;
}

GradientEstimate estimate_gradient(const Problem& problem, const std::vector<double>& theta, const GatedImage& target) {
  const int repeats = gradient_repeats(problem);
  ReplicateStatistics statistics;
  ProgressStage stage("estimating the gradient", repeats);
  for (int r = 0; r < repeats; ++r) {
    std::vector<std::vector<double>> parts;
    const Evaluation evaluation = problem.evaluate(theta, target, 0, {r, repeats}, &parts);
    statistics.add(evaluation.gradient, std::move(parts), 1);
    stage.advance();
  }
  return {statistics.result()};
}

}  // namespace isochron
