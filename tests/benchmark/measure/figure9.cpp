// Interior and path_length terms under a narrow gate, by three ways of sampling at equal times (after the
// paper's Figure 9):
//
//   isochron_figure9 FOLDER CSV [SECONDS]
//
// For experiments/validation/figure9.yaml at the initial values, SECONDS of CPU time (5 unless given) for
// each estimate. FOLDER gets figure9.exr with the components image and TERM_METHOD; CSV gets a row per term
// and method. `cost` is the mean variance over the pixels x CPU seconds; `gain` the cost of standard sampling
// over that of the method. The other gains are those for averages over blocks of 4 x 4 and 16 x 16 pixels,
// and over the image: the two paths of a pair lie about a gate's width apart, and cancel only where one pixel
// holds both. Standard sampling has no way of its own to the path_length term, whose paths have given
// lengths: there it, too, puts vertices on ellipsoids.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "core/base/cpu_time.h"
#include "optim/problem/problem.h"
#include "tests/render/pixel_statistics.h"
#include "tests/render/support.h"

namespace isochron::benchmarks {
namespace {

struct Method {
  const char* name;
  Sampling sampling;
  bool antithetic;
  int samples;  ///< per pixel and batch
};

void measure(const char* folder, std::FILE* csv, double budget) {
  const Problem problem(load_experiment(PROJECT_ROOT "/experiments/validation/figure9.yaml"));
  const std::vector<double> theta = problem.parameters().initial();
  const Scene scene = problem.parameters().apply(theta);
  const TangentBasis basis = problem.parameters().tangent(theta);
  EstimatorOptions options = problem.experiment().estimator;
  options.keep_length = false;  // as in the paper: else the interior term would be all
  std::vector<std::string> names = {"image"};
  std::vector<GatedImage> images = {
      Renderer(scene, problem.gates(), options).render(problem.stream(Pass::primal), {0, 256})};

  std::fprintf(csv, "term,method,samples,mean,standard_error,cost,gain,gain_blocks_4,gain_blocks_16,gain_mean\n");
  for (Term term : {Term::interior, Term::path_length}) {
    std::vector<double> standard;
    for (const Method& method :
         {Method{"standard", Sampling::standard, true, 16}, Method{"ellipsoidal", Sampling::ellipsoidal, false, 2},
          Method{"coupled", Sampling::ellipsoidal, true, 2}}) {
      options.sampling = method.sampling;
      options.antithetic = method.antithetic;
      const Renderer renderer(scene, problem.gates(), options, &basis);
      testing::PixelBatches pixels[4];  // by size of the blocks
      constexpr int kSizes[] = {1, 4, 16, 64};
      testing::Batches means;
      int samples = 0;
      const double start = cpu_seconds();
      for (int b = 0; b < 16 || cpu_seconds() - start < budget; ++b) {
        const GatedImage image =
            renderer.derive(term, problem.stream(pass_of(term)), {samples, samples + method.samples}).front();
        samples += method.samples;
        for (int i = 0; i < 4; ++i) pixels[i].add(testing::blocks(image, kSizes[i]));
        means.add(image.mean(0));
      }
      const double seconds = cpu_seconds() - start;
      std::vector<double> cost;
      for (const testing::PixelBatches& p : pixels) cost.push_back(p.mean_variance() * seconds);
      if (method.sampling == Sampling::standard) standard = cost;
      const testing::Estimate mean = means.estimate();
      std::printf("%-12s %-12s %6d samples  mean % .5f +- %.5f  cost %.3e  gains", name(term), method.name, samples,
                  mean.mean, mean.standard_error, cost[0]);
      std::fprintf(csv, "%s,%s,%d,%.5g,%.2g,%.4g", name(term), method.name, samples, mean.mean, mean.standard_error,
                   cost[0]);
      for (std::size_t i = 0; i < cost.size(); ++i) {
        std::printf(" %.4g", standard[i] / cost[i]);
        std::fprintf(csv, ",%.4g", standard[i] / cost[i]);
      }
      std::printf("\n");
      std::fprintf(csv, "\n");
      std::fflush(stdout);
      names.push_back(std::string(name(term)) + "_" + method.name);
      images.push_back(pixels[0].mean());
    }
  }
  write_exr_components(std::string(folder) + "/figure9.exr", names, images);
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  if (argc < 3 || argc > 4) {
    std::fprintf(stderr, "usage: isochron_figure9 FOLDER CSV [SECONDS]\n");
    return 2;
  }
  std::FILE* csv = std::fopen(argv[2], "w");
  if (!csv) {
    std::fprintf(stderr, "isochron_figure9: cannot write %s\n", argv[2]);
    return 1;
  }
  isochron::benchmarks::measure(argv[1], csv, argc == 4 ? std::atof(argv[3]) : 5);
  std::fclose(csv);
  return 0;
}
