// Derivative images against finite differences, pixel by pixel, and what either costs (after the paper's
// Figure 8):
//
//   isochron_figure8 FOLDER CSV [EFFORT]
//
// For experiments/validation/figure8_*.yaml at the initial values, with EFFORT times the samples there (40
// unless given; finite differences 16 times more), in as many batches. FOLDER gets KIND.exr per gate kind, with the components image,
// finite_difference, total, interior, visibility, path_length and z; CSV gets the figures, in rows
// `gate,figure,value,goal`.
//
// Costs are variance x CPU seconds, which does not depend on the number of samples. Ratios of costs are given
// for the mean variance over all pixels, which few pixels can dominate, and as the median over the pixels
// whose derivative exceeds 5 % of the peak. "Common": finite differences whose two images share their random
// numbers; "independent": whose images do not, nor their samples (numbers: independent). Their variance falls with the
// step, their bias rises: both are given for a range of steps.
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

#include "core/base/cpu_time.h"
#include "optim/problem/problem.h"
#include "tests/render/pixel_statistics.h"

namespace isochron::benchmarks {
namespace {

using testing::PixelBatches;
using testing::PixelEstimate;

class Table {
 public:
  explicit Table(const char* file) : csv_(std::fopen(file, "w")) {
    if (!csv_) {
      std::fprintf(stderr, "isochron_figure8: cannot write %s\n", file);
      std::exit(1);
    }
    std::fprintf(csv_, "gate,figure,value,goal\n");
  }
  ~Table() { std::fclose(csv_); }
  Table(const Table&) = delete;
  Table& operator=(const Table&) = delete;

  void add(const std::string& gate, const std::string& figure, double value, const char* goal = "") {
    std::printf("%-19s %-70s %10.4g  %s\n", gate.c_str(), figure.c_str(), value, goal);
    std::fprintf(csv_, "%s,%s,%.4g,%s\n", gate.c_str(), figure.c_str(), value, goal);
    std::fflush(stdout);
    std::fflush(csv_);
  }

 private:
  std::FILE* csv_;
};

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size()));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}
double median(const std::vector<double>& values) {
  return quantile(values, 0.5);
}

/// Images from batches, and the CPU seconds that they took.
struct Timed {
  PixelBatches batches;
  double seconds = 0;
  double cost() const { return batches.mean_variance() * seconds; }

  template <class F>
  void add(F&& estimate) {
    const double start = cpu_seconds();
    const GatedImage image = estimate();
    seconds += cpu_seconds() - start;
    batches.add(image);
  }
};

/// Central differences with one step: the two images have the same random numbers.
class Differences {
 public:
  Differences(const Problem& problem, const std::vector<double>& theta, double step)
      : step_(step),
        above_(problem.parameters().apply({theta[0] + step})),
        below_(problem.parameters().apply({theta[0] - step})),
        above_renderer_(above_, problem.gates(), problem.experiment().estimator),
        below_renderer_(below_, problem.gates(), problem.experiment().estimator) {}

  void add(const Stream& stream, SampleRange range) {
    difference.add([&] {
      GatedImage result = above_renderer_.render(stream, range);
      const GatedImage below = below_renderer_.render(stream, range);
      for (std::size_t i = 0; i < result.data.size(); ++i)
        result.data[i] = (result.data[i] - below.data[i]) / (2 * step_);
      return result;
    });
  }
  double step() const { return step_; }

  Timed difference;

 private:
  double step_;
  Scene above_, below_;
  Renderer above_renderer_, below_renderer_;
};

/// Few paths tell one image from the other, across jumps of a gate very few: with fewer samples the errors of their
/// difference are far from normal.
constexpr int kMoreDifferences = 16;

void measure(const std::string& kind, const std::string& folder, int effort, Table& table) {
  Experiment experiment = load_experiment(PROJECT_ROOT "/experiments/validation/figure8_" + kind + ".yaml");
  const SampleSpec samples = experiment.samples;
  const double step = experiment.gradient.step;
  const Problem problem(std::move(experiment));
  const std::vector<double> theta = problem.parameters().initial();
  const Scene scene = problem.parameters().apply(theta);
  const TangentBasis basis = problem.parameters().tangent(theta);
  const Renderer renderer(scene, problem.gates(), problem.estimator(effort * samples.visibility, Purpose::images),
                          &basis);
  EstimatorOptions plain = problem.experiment().estimator;
  plain.numbers = Numbers::independent;
  const Renderer plain_renderer(scene, problem.gates(), plain);

  Timed terms[3], images;
  Differences reference(problem, theta, step);
  const auto batch = [](int b, int n) { return SampleRange{b * n, (b + 1) * n}; };
  for (int b = 0; b < effort; ++b) {
    for (Term term : kTerms)
      if (const int n = samples.term(term); n > 0)
        terms[static_cast<int>(term)].add(
            [&] { return renderer.derive(term, problem.stream(pass_of(term)), batch(b, n)).front(); });
    reference.add(problem.stream(Pass::finite_difference), batch(b, kMoreDifferences * samples.primal));
    images.add([&] { return plain_renderer.render(problem.stream(Pass::primal), batch(b, samples.primal)); });
  }

  PixelEstimate ours, difference;
  std::vector<std::string> names = {"image", "finite_difference"};
  std::vector<GatedImage> pictures = {images.batches.mean(), reference.difference.batches.mean()};
  double cost = 0, root_cost = 0, seconds = 0, variance = 0;
  for (Term term : kTerms) {
    if (samples.term(term) == 0) continue;
    const Timed& t = terms[static_cast<int>(term)];
    ours += t.batches;
    names.push_back(name(term));
    pictures.push_back(t.batches.mean());
    seconds += t.seconds;
    variance += t.batches.mean_variance();
    root_cost += std::sqrt(t.cost());
    std::vector<double> shares;
    for (std::size_t i = 0; i < t.batches.mean().data.size(); ++i) shares.push_back(t.batches.variance(i));
    table.add(kind, std::string("mean variance: ") + name(term), t.batches.mean_variance());
    table.add(kind, std::string("99 % quantile of the variance: ") + name(term), quantile(shares, 0.99));
    table.add(kind, std::string("CPU seconds: ") + name(term), t.seconds);
  }
  cost = seconds * variance;
  difference += reference.difference.batches;
  GatedImage total = pictures.back();
  total.data = ours.mean;
  names.push_back("total");
  pictures.push_back(total);

  const auto root_mean = [](const std::vector<double>& v) {
    double sum = 0;
    for (double x : v) sum += x;
    return std::sqrt(sum / static_cast<double>(v.size()));
  };
  const auto largest = [](const std::vector<double>& v) { return std::sqrt(*std::max_element(v.begin(), v.end())); };
  const auto scores = z_scores(ours, difference);
  const double peak = difference.peak();  // ours has outliers
  GatedImage z = total;
  z.data = scores.image;
  names.push_back("z");
  pictures.push_back(z);
  write_exr_components(folder + "/" + kind + ".exr", names, pictures);
  double significant = 0, squares = 0;
  for (std::size_t i = 0; i < ours.mean.size(); ++i)
    if (std::max(std::abs(ours.mean[i]), std::abs(difference.mean[i])) > 0.01 * peak)
      ++significant, squares += scores.image[i] * scores.image[i];
  table.add(kind, "standard deviation of z where the derivative exceeds 1 % of the peak",
            std::sqrt(squares / significant), "0.9 to 1.1");
  table.add(kind, "pixels there", significant);
  table.add(kind, "standard deviation of z over all pixels", scores.standard_deviation(), "0.9 to 1.1");
  table.add(kind, "largest |z|", scores.largest());
  table.add(kind, "pixels", static_cast<double>(total.data.size()));
  table.add(kind, "pixels where both are exactly zero", scores.zero);
  table.add(kind, "largest standard error over peak: ours", largest(ours.variance) / peak, "< 0.05");
  table.add(kind, "largest standard error over peak: finite differences", largest(difference.variance) / peak,
            "< 0.05");
  table.add(kind, "root mean square error over peak: ours", root_mean(ours.variance) / peak);
  table.add(kind, "root mean square error over peak: finite differences", root_mean(difference.variance) / peak);
  table.add(kind, "CPU seconds: finite differences", reference.difference.seconds);
  table.add(kind, "our cost with the samples split best over the cost as split", root_cost * root_cost / cost);

  Differences coarse(problem, theta, 4 * step);
  for (int b = 0; b < effort / 4; ++b)
    coarse.add(problem.stream(Pass::finite_difference, 1), batch(b, kMoreDifferences * samples.primal));
  for (const Differences& other : {std::cref(coarse), std::cref(reference)}) {
    PixelEstimate values;
    values += other.difference.batches;
    double bias = 0;
    for (std::size_t i = 0; i < ours.mean.size(); ++i) {
      const double d = values.mean[i] - ours.mean[i];
      bias += (d * d - values.variance[i] - ours.variance[i]) / static_cast<double>(ours.mean.size());
    }
    // The variances of two images add, and so do their times.
    const double of_images = images.seconds / (other.step() * other.step());
    std::vector<double> common, independent;
    for (std::size_t i = 0; i < ours.mean.size(); ++i) {
      if (std::abs(ours.mean[i]) < 0.05 * peak) continue;
      const double own = ours.variance[i] * seconds, time = other.difference.seconds;
      common.push_back(own / (values.variance[i] * time));
      independent.push_back(own / (images.batches.variance(i) * of_images));
    }
    char label[100];
    std::snprintf(label, sizeof label, "step %g: ", other.step());
    const std::string at = label;
    table.add(kind, at + "cost of ours over common; mean variance", cost / other.difference.cost());
    table.add(kind, at + "cost of ours over common; median pixel", median(common), "<= 0.2");
    table.add(kind, at + "cost of ours over independent; mean variance",
              cost / (images.batches.mean_variance() * of_images));
    table.add(kind, at + "cost of ours over independent; median pixel", median(independent), "<= 0.01");
    table.add(kind, at + "root mean square bias over peak", std::copysign(std::sqrt(std::abs(bias)), bias) / peak);
  }
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron::benchmarks;
  if (argc < 3 || argc > 4) {
    std::fprintf(stderr, "usage: isochron_figure8 FOLDER CSV [EFFORT]\n");
    return 2;
  }
  const int effort = argc == 4 ? std::max(8, std::atoi(argv[3])) : 24;
  Table table(argv[2]);
  for (const char* kind : {"gaussian", "boxcar", "truncated_gaussian"}) measure(kind, argv[1], effort, table);
  return 0;
}
