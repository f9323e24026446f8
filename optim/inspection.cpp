#include "optim/inspection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>

namespace isochron {
namespace {

/// Random numbers of inspections, apart from those of any iteration.
constexpr std::uint32_t kInspection = 1u << 30;
constexpr int kReplicates = 24;
constexpr int kMostSamples = 1 << 20;  ///< per pixel and replicate

/// Of this process, all threads.
double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Per unknown, see PointInspection::gradient.
std::vector<double> units(const Parameters& parameters) {
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

/// The sum over paths of 0 .. limit bounces of a sorted image.
GatedImage image_up_to(const GatedImage& sorted, int gates, int limit) {
  GatedImage image(sorted.width, sorted.height, gates, sorted.channels);
  for (int pixel = 0; pixel < image.pixels(); ++pixel)
    for (int b = 0; b <= limit; ++b)
      for (int g = 0; g < gates; ++g)
        for (int c = 0; c < image.channels; ++c) image.at(pixel, g, c) += sorted.at(pixel, b * gates + g, c);
  return image;
}

/// Shares from ledgers, replicate by replicate.
class ShareCollector {
 public:
  void add_light(const ImageLedger& ledger) {
    std::vector<double> slots;
    for (int s = 0; s < ledger.image.gates; ++s)
      slots.push_back(ledger.image.mean(s) * ledger.image.pixels() * ledger.image.channels);
    light_.push_back(std::move(slots));
    by_shape_.push_back(ledger.by_shape);
  }
  /// The three terms, each by bounces (first adjoint), gates and shapes, [.][column].
  struct Gradient {
    std::vector<double> by_bounces, by_gate, by_shape;
  };
  void add_gradient(Gradient gradient) { gradients_.push_back(std::move(gradient)); }

  Shares result(int columns) const {
    Shares shares;
    double light = 0;
    for (const auto& slots : light_)
      for (double s : slots) light += s / static_cast<double>(light_.size());
    shares.light = statistics(light_, light);
    shares.light_by_shape = statistics(by_shape_, light);

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
        for (std::size_t i = 0; i < (g.*part).size(); ++i)
          row[i / columns] += (g.*part)[i] * mean[i % columns];
        projections.push_back(std::move(row));
      }
      return statistics(projections, square);
    };
    shares.by_bounces = project(&Gradient::by_bounces);
    shares.by_gate = project(&Gradient::by_gate);
    shares.by_shape = project(&Gradient::by_shape);
    return shares;
  }

 private:
  /// Over the whole; zeros where there is nothing at all.
  static Statistics statistics(std::vector<std::vector<double>> rows, double whole) {
    BatchStatistics batches;
    for (auto& row : rows) {
      for (double& value : row) value = whole != 0 ? value / whole : 0;
      batches.add(row, 1);
    }
    return batches.result();
  }
  std::vector<std::vector<double>> light_, by_shape_;
  std::vector<Gradient> gradients_;
};

}  // namespace

std::vector<InspectedPoint> points_to_inspect(const Parameters& parameters,
                                              const std::vector<double>& start) {
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
  return experiment.target.images.empty() ? std::max(own, experiment.target.max_bounces) : own;
}

PointInspection inspect_point(const Problem& problem, const InspectedPoint& point, double seconds,
                              const Poll& poll) {
  const Experiment& experiment = problem.experiment();
  const Parameters& parameters = problem.parameters();
  const int gates = problem.gates().size(), columns = parameters.size(), most = full_bounces(experiment);
  const std::vector<double> unit = units(parameters);
  const Scene scene = parameters.apply(point.theta);
  const TangentBasis basis = parameters.tangent(point.theta);
  EstimatorOptions options = problem.estimator(std::max(experiment.samples.visibility, 64));
  options.max_bounces = most;
  const Renderer renderer(scene, problem.gates(), options, &basis);

  // A target from a file is fixed; else every replicate has its own.
  const bool rendered = experiment.target.images.empty();
  const Scene target_scene = rendered ? parameters.apply(parameters.target()) : Scene();
  std::optional<Renderer> target_renderer;
  GatedImage target;
  if (rendered)
    target_renderer.emplace(target_scene, problem.gates(), options);
  else
    target = problem.read_target(experiment.target.images);

  PointInspection result;
  result.point = point;
  result.gradient = GradientReplicates(most, columns);
  int parts = 1;
  for (int t = 0; t < 3; ++t) {
    result.can_be[t] = renderer.has(kTerms[t]);
    parts += result.can_be[t];
  }
  const double seconds_per_part = seconds / kReplicates / parts;
  const auto stream = [&](Pass pass, int replicate) {
    return problem.stream(pass, kInspection + static_cast<std::uint32_t>(replicate));
  };
  const auto images = [&](int replicate, int samples) {
    if (rendered) target = target_renderer->render(stream(Pass::primal, replicate), {0, samples});
    return renderer.render_ledger(stream(Pass::primal, replicate), {0, samples});
  };
  /// Of the images up to most, most - 1, ... bounces.
  const auto adjoints = [&](const ImageLedger& ledger) {
    std::vector<GatedImage> all;
    const RobustLoss robust = problem.robust_loss(target);
    for (int limit = most; limit >= 0; --limit)
      all.push_back(loss_adjoint(image_up_to(ledger.image, gates, limit), target, robust));
    return all;
  };

  const int trial = kReplicates;  // its random numbers are used for nothing else
  result.samples[0] = samples_within(seconds_per_part, [&](int samples) { images(trial, samples); });
  const std::vector<GatedImage> trial_adjoints = adjoints(images(trial, 1));
  for (int t = 0; t < 3; ++t) {
    if (!result.can_be[t]) continue;
    const auto pass = [&](int samples) {
      renderer.gradient_ledger(kTerms[t], trial_adjoints, stream(pass_of(kTerms[t]), trial), {0, samples});
    };
    pass(1);  // visibility learns once
    result.samples[1 + t] = samples_within(seconds_per_part, pass);
    poll();
  }

  ShareCollector shares;
  ImageMean mean_target;
  for (int r = 0; r < kReplicates; ++r) {
    const ImageLedger ledger = images(r, static_cast<int>(result.samples[0]));
    mean_target.add(target, 1);
    shares.add_light(ledger);
    poll();
    const std::vector<GatedImage> adjoint = adjoints(ledger);
    std::vector<double> limits((most + 1) * 3 * columns, 0.0);
    ShareCollector::Gradient sorted;
    for (int t = 0; t < 3; ++t) {
      const SampleRange range{0, static_cast<int>(result.samples[1 + t])};
      GradientLedger g = renderer.gradient_ledger(kTerms[t], adjoint, stream(pass_of(kTerms[t]), r), range);
      for (int b = 0; b <= most; ++b)
        for (int c = 0; c < columns; ++c) {
          for (int limit = b; limit <= most; ++limit)
            limits[GradientReplicates::index(limit, t, c, columns)] +=
                unit[c] * g.by_bounces[g.index(b, c) + most - limit];
          sorted.by_bounces.push_back(unit[c] * g.by_bounces[g.index(b, c)]);
          if (sorted.by_bounces.back() != 0) result.found[t] = true;
        }
      for (std::size_t i = 0; i < g.by_gate.size(); ++i)
        sorted.by_gate.push_back(unit[i % columns] * g.by_gate[i]);
      for (std::size_t i = 0; i < g.by_shape.size(); ++i)
        sorted.by_shape.push_back(unit[i % columns] * g.by_shape[i]);
      poll();
    }
    result.gradient.add(std::move(limits));
    shares.add_gradient(std::move(sorted));
  }
  result.shares = shares.result(columns);
  result.target = mean_target.mean();
  return result;
}

GradientCost measure_cost(const Problem& problem, const std::vector<double>& theta, const GatedImage& target,
                          const std::array<bool, 3>& kept, double seconds, const Poll& poll) {
  constexpr int kImages = 16, kBatches = kMostBatches, kTimings = 3;
  const SampleSpec& spec = problem.experiment().samples;
  const int columns = problem.parameters().size();
  const std::vector<double> unit = units(problem.parameters());
  const RobustLoss robust = problem.robust_loss(target);
  const auto stream = [&](Pass pass, int i) {
    return problem.stream(pass, kInspection + (1u << 20) + static_cast<std::uint32_t>(i));
  };
  const auto scaled = [&](int samples, double factor) {
    return std::max(1, static_cast<int>(std::lround(factor * samples)));
  };
  const std::array<int, kPasses> full{spec.primal, spec.interior, spec.visibility, spec.path_length};
  std::array<int, kPasses> n;
  const auto set = [&](double factor) {
    for (int i = 0; i < kPasses; ++i) n[i] = scaled(full[i], factor);
  };
  const double pixels = problem.scene().camera.width * problem.scene().camera.height;

  // One evaluation as the optimiser has it, with everything that is made anew. CPU seconds: overhead, then
  // the passes.
  std::array<std::vector<double>, 1 + kPasses> times;
  const auto evaluate = [&](int repeat) {
    double last = cpu_seconds();
    const auto lap = [&](int what) {
      const double now = cpu_seconds();
      times[what].push_back(now - last);
      last = now;
    };
    const Scene scene = problem.parameters().apply(theta);
    const TangentBasis basis = problem.parameters().tangent(theta);
    const Renderer renderer(scene, problem.gates(), problem.estimator(n[2]), &basis);
    lap(0);
    const GatedImage image = renderer.render(stream(Pass::primal, repeat), {0, n[0]});
    const GatedImage adjoint = loss_adjoint(image, target, robust);
    lap(1);
    std::vector<double> dof_gradient(DofLayout(scene).size(), 0.0);
    for (int t = 0; t < 3; ++t) {
      if (kept[t])
        renderer.add_gradient(kTerms[t], adjoint, stream(pass_of(kTerms[t]), repeat), {0, n[1 + t]},
                              dof_gradient);
      lap(2 + t);
    }
    poll();
  };
  set(0.125);
  const double start = cpu_seconds();
  evaluate(0);
  // An evaluation with all samples would take 8 times as long; ledgers take about twice as long as plain
  // passes.
  const double whole = 8 * (cpu_seconds() - start);
  set(std::min(1.0, seconds / (whole * (kTimings + 2 * kBatches))));
  for (auto& t : times) t.clear();
  for (int repeat = 0; repeat < kTimings; ++repeat) evaluate(repeat);
  GradientCost result;
  for (auto& t : times) std::sort(t.begin(), t.end());
  result.overhead = times[0][kTimings / 2];
  for (int i = 0; i < kPasses; ++i)
    if (i == 0 || kept[i - 1]) result.seconds[i] = times[1 + i][kTimings / 2] / n[i] / pixels;

  // Every image with every batch of every term.
  const Scene scene = problem.parameters().apply(theta);
  const TangentBasis basis = problem.parameters().tangent(theta);
  const Renderer renderer(scene, problem.gates(), problem.estimator(spec.visibility), &basis);
  std::vector<GatedImage> adjoints;
  for (int i = 0; i < kImages; ++i) {
    adjoints.push_back(loss_adjoint(renderer.render(stream(Pass::primal, i), {0, n[0]}), target, robust));
    poll();
  }
  // [column][image], means over batches, summed over terms; and how much of their variance is the batches'.
  std::vector<std::vector<double>> image_rows(columns, std::vector<double>(kImages, 0.0));
  double of_batches = 0;
  for (int t = 0; t < 3; ++t) {
    if (!kept[t]) continue;
    std::vector<std::vector<std::vector<double>>> tables(
        columns, std::vector<std::vector<double>>(kImages, std::vector<double>(kBatches, 0.0)));
    BatchStatistics batches;
    for (int b = 0; b < kBatches; ++b) {
      const GradientLedger ledger =
          renderer.gradient_ledger(kTerms[t], adjoints, stream(pass_of(kTerms[t]), b), {0, n[1 + t]});
      std::vector<double> means(columns, 0.0);
      for (std::size_t i = 0; i < ledger.by_bounces.size(); ++i) {
        const std::size_t column = i / kImages % columns, image = i % kImages;
        tables[column][image][b] += unit[column] * ledger.by_bounces[i];
        means[column] += ledger.by_bounces[i] / kImages;
      }
      batches.add(means, 1);
      poll();
    }
    for (double k : batches.result().kurtosis) result.kurtosis = std::max(result.kurtosis, k);
    for (int c = 0; c < columns; ++c) {
      const VarianceComponents v = variance_components(tables[c]);
      result.variance.term[t] += v.columns * n[1 + t];
      result.variance.cross[t] += v.cells * n[0] * n[1 + t];
      of_batches += v.cells / kBatches;
      for (int i = 0; i < kImages; ++i)
        for (double x : tables[c][i]) image_rows[c][i] += x / kBatches;
    }
  }
  double of_images = -of_batches;
  for (const auto& row : image_rows) {
    double mean = 0, squares = 0;
    for (double x : row) mean += x / kImages;
    for (double x : row) squares += (x - mean) * (x - mean);
    of_images += squares / (kImages - 1);
  }
  // Below zero by noise alone.
  result.variance.image = std::max(0.0, of_images * n[0]);
  for (double& v : result.variance.term) v = std::max(0.0, v);
  return result;
}

}  // namespace isochron
