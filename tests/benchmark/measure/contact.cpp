// Objects that touch and move against each other: isochron_contact CSV [FACTOR]. Rows of two kinds (FACTOR multiplies the
// samples of the second):
//
//   cost    tests/data/cornell, four bounces, derivative of the image along x of the small box, on the floor or raised by
//           0.1: variance x CPU seconds over the mean square, summed over pixels, of SEEDS independent images; `low` and
//           `high` are the extremes among pairs of them
//   hill    Hill's index of the largest thousandth, ten-thousandth and hundred-thousandth of single samples of the interior
//           term there; `low` and `high` a standard error to each side
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/base/cpu_time.h"
#include "core/base/parallel.h"
#include "tests/benchmark/measure/arguments.h"
#include "tests/render/contact_scenes.h"
#include "tests/render/pixel_statistics.h"

namespace isochron::benchmarks {
namespace {

using namespace testing;

constexpr int kSeeds = 4;
/// Of the visibility term's samples, spent on learning.
constexpr double kLearningShare = 0.06;

class Table {
 public:
  explicit Table(std::FILE* file) : file_(file) {
    std::fprintf(file_, "kind,case,gate,follow,samples,value,low,high\n");
  }
  void row(const char* kind, const char* name, const char* gate, double follow, int samples, double value, double low,
           double high) {
    for (std::FILE* out : {file_, stdout}) {
      std::fprintf(out, "%s,%s,%s,%g,%d,%.4g,%.4g,%.4g\n", kind, name, gate, follow, samples, value, low, high);
      std::fflush(out);
    }
  }

 private:
  std::FILE* file_;
};

struct Box {
  const char* name;
  double raised;
};
constexpr Box kBoxes[] = {{"on the floor", 0}, {"raised", 0.1}};

Scene cornell(double raised) {
  Scene scene = load_scene(PROJECT_ROOT "/tests/data/cornell/scene.yaml");
  translate(scene, "smallbox", {0, 1, 0}).apply(scene, raised);
  return scene;
}

double sum_of_squares(const GatedImage& image) {
  double sum = 0;
  for (double x : image.data) sum += x * x;
  return sum;
}

/// Independent images of the whole derivative: variance x seconds of one, over the mean square.
void cost(Table& table, const Box& box, const char* gate, double follow, int samples) {
  const Scene scene = cornell(box.raised);
  const TangentBasis basis = make_basis(scene, {translate(scene, "smallbox", {1, 0, 0})});
  const bool steady = gate[0] == 's';
  const GateSet gates = steady ? GateSet(GateShape::steady(), {0}) : GateSet(GateShape::boxcar(0.5), {8.25});
  const EstimatorOptions options{.max_bounces = 4,
                                 .sampling = Sampling::standard,
                                 .follow = follow,
                                 .guiding_samples = kLearningShare * samples_of(Term::visibility, samples)};
  std::vector<GatedImage> images;
  PixelBatches pixels;
  const double start = cpu_seconds();
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Renderer renderer(scene, gates, options, &basis);
    GatedImage image;
    for (Term term : kTerms) {
      if (!renderer.has(term)) continue;
      const Stream stream{61 + seed, 0, 1 + static_cast<std::uint32_t>(term)};
      const GatedImage part = renderer.derive(term, stream, {0, samples_of(term, samples)})[0];
      if (image.data.empty())
        image = part;
      else
        for (std::size_t i = 0; i < part.data.size(); ++i) image.data[i] += part.data[i];
    }
    pixels.add(image);
    images.push_back(std::move(image));
  }
  const double seconds = (cpu_seconds() - start) / kSeeds;
  // The mean's square contains its own variance.
  const double values = static_cast<double>(pixels.mean().data.size());
  const double of_mean = pixels.mean_variance() * values;
  const double scale = seconds / (sum_of_squares(pixels.mean()) - of_mean);
  std::vector<double> pairs;
  for (int i = 0; i < kSeeds; i += 2) {
    GatedImage difference = images[i];
    for (std::size_t k = 0; k < difference.data.size(); ++k) difference.data[k] -= images[i + 1].data[k];
    pairs.push_back(0.5 * sum_of_squares(difference) * scale);
  }
  const auto [low, high] = std::minmax_element(pairs.begin(), pairs.end());
  table.row("cost", box.name, gate, follow, samples, kSeeds * of_mean * scale, *low, *high);
}

/// A range of one sample puts a single one into each pixel.
void hill(Table& table, const Box& box, double follow, int samples) {
  const Scene scene = cornell(box.raised);
  const TangentBasis basis = make_basis(scene, {translate(scene, "smallbox", {1, 0, 0})});
  const GateSet gates(GateShape::steady(), {0});
  const Renderer renderer(scene, gates, {.max_bounces = 4, .sampling = Sampling::standard, .follow = follow}, &basis);
  std::vector<double> sizes;
  for (int i = 0; i < samples; ++i) {
    const GatedImage image = renderer.derive(Term::interior, {62, 0, 1}, {i, i + 1})[0];
    for (std::size_t k = 0; k < image.data.size(); k += image.channels) sizes.push_back(std::abs(image.data[k]));
  }
  std::sort(sizes.begin(), sizes.end(), std::greater<>());
  for (const auto& [name, fraction] : {std::pair{"1e-3", 1e-3}, {"1e-4", 1e-4}, {"1e-5", 1e-5}}) {
    const auto count = static_cast<std::size_t>(fraction * static_cast<double>(sizes.size()));
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) sum += std::log(sizes[i] / sizes[count]);
    const double index = static_cast<double>(count) / sum, error = index / std::sqrt(static_cast<double>(count));
    table.row("hill", box.name, name, follow, samples, index, index - error, index + error);
  }
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron;
  using namespace isochron::benchmarks;
  const Arguments arguments = read_arguments(argc, argv, 1, "isochron_contact CSV [FACTOR]", 4, 1);
  std::FILE* const csv = arguments.csv.get();
  const int factor = arguments.number;
  Table table(csv);
  set_thread_count(1);
  for (const Box& box : kBoxes)
    for (const char* gate : {"steady", "boxcar 0.5"}) {
      for (int samples : {16, 64}) cost(table, box, gate, 1, samples);
      cost(table, box, gate, 0, 64);
    }
  for (const Box& box : kBoxes)
    for (double follow : {1.0, 0.0}) hill(table, box, follow, 512 * factor);
  return 0;
}
