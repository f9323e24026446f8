#include "optim/analysis/inspection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numeric>
#include <stdexcept>

#include "core/base/cpu_time.h"

namespace isochron {
namespace {

constexpr int kReplicates = 24;
constexpr int kMostSamples = 1 << 20;  ///< per pixel and replicate

/// How often `pass(samples)`, timed, may run in so many seconds: samples of one run.
template <class Pass>
int samples_within(double seconds, Pass&& pass) {
  constexpr double kTrial = 0.1;  ///< of the time, so that what is lost on trials stays below it twice
  for (int samples = 1;; samples *= 4) {
    const double start = cpu_seconds();
    pass(samples);
    const double used = cpu_seconds() - start;
    if (used > kTrial * seconds || samples >= kMostSamples / 4)
      return std::clamp(static_cast<int>(samples * seconds / std::max(used, 1e-9)), 1, kMostSamples);
  }
}

/// What each technique takes of the work of a pass over the samples.
class WorkByTechnique {
 public:
  explicit WorkByTechnique(const Renderer& renderer) : renderer_(renderer), before_(now()) {}
  /// Adds what was done since.
  void add_to(std::array<double, kTechniques>& work) const {
    const auto after = now();
    for (int t = 0; t < kTechniques; ++t) work[t] += after[t] - before_[t];
  }

 private:
  std::array<double, kTechniques> now() const {
    std::array<double, kTechniques> work;
    for (int t = 0; t < kTechniques; ++t) work[t] = renderer_.work_of(static_cast<Technique>(t));
    return work;
  }
  const Renderer& renderer_;
  const std::array<double, kTechniques> before_;
};

void make_shares(std::array<double, kTechniques>& work) {
  const double all = std::accumulate(work.begin(), work.end(), 0.0);
  for (double& w : work) w = all > 0 ? w / all : 0;
}

/// The sum over paths of 0 .. limit bounces of a sorted image.
GatedImage image_up_to(const GatedImage& sorted, int gates, int limit) {
  GatedImage image(sorted.width, sorted.height, gates, sorted.channels);
  for (int pixel = 0; pixel < image.pixels(); ++pixel)
    for (int b = 0; b <= limit; ++b)
      for (int g = 0; g < gates; ++g)
        for (int c = 0; c < image.channels; ++c) image.at(pixel, g, c) += sorted.at(pixel, b * gates + g, c);
  return image;
}

/// Shares from breakdowns, replicate by replicate.
class ShareCollector {
 public:
  void add_light(const ImageBreakdown& breakdown) {
    std::vector<double> slots;
    for (int s = 0; s < breakdown.image.gates; ++s)
      slots.push_back(breakdown.image.mean(s) * breakdown.image.pixels() * breakdown.image.channels);
    light_.push_back(std::move(slots));
    by_shape_.push_back(breakdown.by_shape);
    by_technique_.push_back(breakdown.by_technique);
  }
  /// The three terms, each by bounces (first adjoint), gates, shapes and techniques, [.][column].
  struct Gradient {
    std::vector<double> by_bounces, by_gate, by_shape, by_technique;
  };
  void add_gradient(Gradient gradient) { gradients_.push_back(std::move(gradient)); }

  Shares result(int columns) const {
    Shares shares;
    double light = 0;
    for (const auto& slots : light_)
      for (double s : slots) light += s / static_cast<double>(light_.size());
    shares.light = statistics(light_, light);
    shares.light_by_shape = statistics(by_shape_, light);
    shares.light_by_technique = statistics(by_technique_, light);

    std::vector<double> mean(columns, 0.0);
    for (const Gradient& g : gradients_)
      for (std::size_t i = 0; i < g.by_bounces.size(); ++i)
        mean[i % columns] += g.by_bounces[i] / static_cast<double>(gradients_.size());
    double square = 0;
    for (double m : mean) square += m * m;
    const auto project = [&](std::vector<double> Gradient::*part) {
      std::vector<std::vector<double>> projections;
      for (const Gradient& g : gradients_) {
        std::vector<double> row((g.*part).size() / columns, 0.0);
        for (std::size_t i = 0; i < (g.*part).size(); ++i) row[i / columns] += (g.*part)[i] * mean[i % columns];
        projections.push_back(std::move(row));
      }
      return statistics(projections, square);
    };
    shares.by_bounces = project(&Gradient::by_bounces);
    shares.by_gate = project(&Gradient::by_gate);
    shares.by_shape = project(&Gradient::by_shape);
    shares.by_technique = project(&Gradient::by_technique);
    return shares;
  }

 private:
  /// Over the whole; zeros where there is nothing at all.
  static Statistics statistics(std::vector<std::vector<double>> rows, double whole) {
    ReplicateStatistics batches;
    for (auto& row : rows) {
      for (double& value : row) value = whole != 0 ? value / whole : 0;
      batches.add(row, 1);
    }
    return batches.result();
  }
  std::vector<std::vector<double>> light_, by_shape_, by_technique_;
  std::vector<Gradient> gradients_;
};

}  // namespace

std::vector<double> comparable_units(const Parameters& parameters) {
  std::vector<double> result(parameters.size(), 1.0);
  for (const Parameters::Block& block : parameters.blocks()) {
    double squares = 0;
    for (int i = block.begin; i < block.begin + block.count; ++i) {
      const double way = parameters.target()[i] - parameters.initial()[i];
      squares += way * way / block.count;
    }
    if (squares > 0)  // not so where a value is NaN, that is, unknown
      std::fill_n(result.begin() + block.begin, block.count, std::sqrt(squares));
  }
  return result;
}

Stream inspection_stream(const Problem& problem, Pass pass, int index) {
  constexpr std::uint32_t kInspection = 1u << 30;
  return problem.stream(pass, kInspection + static_cast<std::uint32_t>(index));
}

std::vector<InspectedPoint> points_to_inspect(const Parameters& parameters, const std::vector<double>& start) {
  std::vector<InspectedPoint> points{{"start", start}};
  if (!parameters.target_known()) return points;
  const auto on_the_way = [&](const char* name, double share) {
    std::vector<double> theta = start;
    for (std::size_t i = 0; i < theta.size(); ++i) theta[i] += share * (parameters.target()[i] - start[i]);
    points.push_back({name, theta});
  };
  on_the_way("half way", 0.5);
  on_the_way("9/10 of the way", 0.9);
  return points;
}

int full_bounces(const Experiment& experiment) {
  const int own = experiment.estimator.max_bounces;
  return !experiment.target.measured() ? std::max(own, experiment.target.max_bounces) : own;
}

PointInspection inspect_point(const Problem& problem, const InspectedPoint& point, double seconds) {
  const Experiment& experiment = problem.experiment();
  const Parameters& parameters = problem.parameters();
  const int gates = problem.gates().size(), columns = parameters.size(), most = full_bounces(experiment);
  const std::vector<double> unit = comparable_units(parameters);
  const Scene scene = parameters.apply(point.theta);
  const TangentBasis basis = parameters.tangent(point.theta);
  EstimatorOptions options = problem.estimator(std::max(experiment.samples.visibility, 64));
  options.max_bounces = most;
  const Renderer renderer(scene, problem.gates(), options, &basis);

  // A target from a file is fixed; else every replicate has its own.
  const bool rendered = !experiment.target.measured();
  const Scene target_scene = rendered ? parameters.apply(parameters.target()) : Scene();
  std::optional<Renderer> target_renderer;
  GatedImage target;
  if (rendered)
    target_renderer.emplace(target_scene, problem.gates(), options);
  else
    target = problem.make_target();

  PointInspection result;
  result.point = point;
  result.gradient = GradientReplicates(most, columns);
  int parts = 1;
  for (int t = 0; t < 3; ++t) {
    result.can_be[t] = renderer.has(kTerms[t]);
    parts += result.can_be[t];
  }
  const double seconds_per_part = seconds / kReplicates / parts;
  const auto stream = [&](Pass pass, int replicate) { return inspection_stream(problem, pass, replicate); };
  const auto images = [&](int replicate, int samples) {
    if (rendered) target = target_renderer->render(stream(Pass::primal, replicate), {0, samples});
    return renderer.render_breakdown(stream(Pass::primal, replicate), {0, samples});
  };
  /// Of the images up to most, most - 1, ... bounces.
  const auto adjoints = [&](const ImageBreakdown& breakdown) {
    std::vector<GatedImage> all;
    const ReadingLoss robust = problem.reading_loss(target);
    for (int limit = most; limit >= 0; --limit)
      all.push_back(loss_adjoint(image_up_to(breakdown.image, gates, limit), target, robust));
    return all;
  };

  const int trial = kReplicates;  // its random numbers are used for nothing else
  result.samples[0] = samples_within(seconds_per_part, [&](int samples) { images(trial, samples); });
  const std::vector<GatedImage> trial_adjoints = adjoints(images(trial, 1));
  for (int t = 0; t < 3; ++t) {
    if (!result.can_be[t]) continue;
    const auto pass = [&](int samples) {
      renderer.gradient_breakdown(kTerms[t], trial_adjoints, stream(pass_of(kTerms[t]), trial), {0, samples});
    };
    pass(1);  // visibility learns once
    result.samples[1 + t] = samples_within(seconds_per_part, pass);
  }

  ShareCollector shares;
  ImageMean mean_target;
  for (int r = 0; r < kReplicates; ++r) {
    const WorkByTechnique of_images(renderer);
    const ImageBreakdown breakdown = images(r, static_cast<int>(result.samples[0]));
    of_images.add_to(result.work[0]);
    mean_target.add(target, 1);
    shares.add_light(breakdown);
    const std::vector<GatedImage> adjoint = adjoints(breakdown);
    std::vector<double> limits((most + 1) * 3 * columns, 0.0);
    ShareCollector::Gradient sorted;
    for (int t = 0; t < 3; ++t) {
      const SampleRange range{0, static_cast<int>(result.samples[1 + t])};
      const WorkByTechnique of_term(renderer);
      GradientBreakdown g = renderer.gradient_breakdown(kTerms[t], adjoint, stream(pass_of(kTerms[t]), r), range);
      of_term.add_to(result.work[1 + t]);
      for (int b = 0; b <= most; ++b)
        for (int c = 0; c < columns; ++c) {
          for (int limit = b; limit <= most; ++limit)
            limits[GradientReplicates::index(limit, t, c, columns)] +=
                unit[c] * g.by_bounces[g.index(b, c) + most - limit];
          sorted.by_bounces.push_back(unit[c] * g.by_bounces[g.index(b, c)]);
          if (sorted.by_bounces.back() != 0) result.found[t] = true;
        }
      for (std::size_t i = 0; i < g.by_gate.size(); ++i) sorted.by_gate.push_back(unit[i % columns] * g.by_gate[i]);
      for (std::size_t i = 0; i < g.by_shape.size(); ++i) sorted.by_shape.push_back(unit[i % columns] * g.by_shape[i]);
      for (std::size_t i = 0; i < g.by_technique.size(); ++i)
        sorted.by_technique.push_back(unit[i % columns] * g.by_technique[i]);
    }
    if (!std::all_of(limits.begin(), limits.end(), [](double x) { return std::isfinite(x); }))
      throw std::runtime_error(fmt::format("the gradient at {} is not finite", point.name));
    result.gradient.add(std::move(limits));
    shares.add_gradient(std::move(sorted));
  }
  for (auto& work : result.work) make_shares(work);
  result.shares = shares.result(columns);
  result.target = mean_target.mean();
  return result;
}

}  // namespace isochron
