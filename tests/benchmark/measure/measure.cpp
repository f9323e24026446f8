// The project's performance figures: isochron_measure CSV [ROUNDS]. Prints a table and writes it as CSV.
//
// Every figure is a ratio of two measurements that alternate, A B A B ..., so that whatever else the machine
// does strikes both; reported is the median of the pairs' ratios. Single-thread figures use the thread's CPU
// time.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/base/large_blocks.h"
#include "core/base/parallel.h"
#include "core/render/renderer.h"
#include "tests/benchmark/rays.h"
#include "tests/benchmark/scenes.h"

namespace isochron::benchmarks {
namespace {

double seconds(clockid_t clock) {
  timespec t;
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Pair {
  double first, second;  ///< median seconds
  double ratio;          ///< median of first / second
  double least_ratio;    ///< least first / least second: of runs that nothing else disturbed
};

/// Alternates the two; each returns what its time is divided by (rays, samples).
Pair measure_pair(int rounds, clockid_t clock, const std::function<double()>& first,
                  const std::function<double()>& second) {
  const auto time = [clock](const std::function<double()>& work) {
    const double start = seconds(clock);
    const double amount = work();
    return (seconds(clock) - start) / amount;
  };
  first();
  second();
  std::vector<double> a, b, ratio;
  for (int round = 0; round < rounds; ++round) {
    a.push_back(time(first));
    b.push_back(time(second));
    ratio.push_back(a.back() / b.back());
  }
  return {median(a), median(b), median(ratio), *std::ranges::min_element(a) / *std::ranges::min_element(b)};
}

class Report {
 public:
  explicit Report(const char* file) : csv_(std::fopen(file, "w")) {
    if (!csv_) {
      std::fprintf(stderr, "isochron_measure: cannot write %s\n", file);
      std::exit(1);
    }
    std::fprintf(csv_, "figure,case,value,unit,goal\n");
  }
  ~Report() { std::fclose(csv_); }
  Report(const Report&) = delete;
  Report& operator=(const Report&) = delete;

  void add(const std::string& figure, const std::string& what, double value, const char* unit, const char* goal = "") {
    std::printf("%-34s %-62s %9.3f %-8s %s\n", figure.c_str(), what.c_str(), value, unit, goal);
    std::fprintf(csv_, "%s,%s,%.4g,%s,%s\n", figure.c_str(), what.c_str(), value, unit, goal);
    std::fflush(stdout);
    std::fflush(csv_);
  }

 private:
  std::FILE* csv_;
};

struct NamedScene {
  std::string name;
  Scene scene;
};

constexpr SampleRange kSamples{0, 16};

GatedImage unit_adjoint(const Scene& scene, const GateSet& gates) {
  GatedImage adjoint(scene.camera.width, scene.camera.height, gates.size(), scene.grey ? 1 : 3);
  std::fill(adjoint.data.begin(), adjoint.data.end(), 1.0);
  return adjoint;
}

/// Rays per second of a rendering over those of bare Embree on the same rays.
void measure_forward(const NamedScene& s, int rounds, Report& report) {
  const GateSet gates = wide_gates();
  for (const int bounces : {3, 8}) {
    const PreparedScene prepared(s.scene, nullptr);
    const auto rays = record_rays(prepared, gates, bounces, kSamples.count());
    const Renderer renderer(s.scene, gates, {.max_bounces = bounces, .sampling = Sampling::standard});
    const Pair pair = measure_pair(
        rounds, CLOCK_THREAD_CPUTIME_ID,
        [&] {
          trace_bare(prepared.caster.embree_scene(), rays);
          return static_cast<double>(rays.size());
        },
        [&] {
          const long long before = renderer.rays();
          renderer.render({.seed = 3}, kSamples);
          return static_cast<double>(renderer.rays() - before);
        });
    const std::string what = s.name + " " + std::to_string(bounces) + " bounces";
    report.add("Embree alone", what, 1e-6 / pair.first, "Mrays/s");
    report.add("render", what, 1e-6 / pair.second, "Mrays/s");
    report.add("render / Embree alone", what, pair.ratio, "", ">= 0.5");
  }
}

/// Time of the gradient passes over the primal pass's at the same number of samples: each alone and all together.
void measure_gradient(const NamedScene& s, int rounds, Report& report) {
  struct Case {
    const char* name;
    GateSet gates;
    Sampling sampling;
    int samples;
  };
  for (const Case& c :
       {Case{"standard", wide_gates(), Sampling::standard, 16},
        Case{"ellipsoidal", narrow_gates(), Sampling::ellipsoidal, 4},
        Case{"jumps", GateSet(GateShape::truncated_gaussian(0.03, 0.06), {6}), Sampling::ellipsoidal, 4}}) {
    const EstimatorOptions options{.max_bounces = 3, .sampling = c.sampling};
    for (const bool vertices : {false, true}) {
      const TangentBasis basis = vertices ? all_vertices(s.scene) : translation(s.scene);
      const Renderer renderer(s.scene, c.gates, options, &basis);
      const GatedImage adjoint = unit_adjoint(s.scene, c.gates);
      std::vector<double> gradient(DofLayout(s.scene).size());
      const auto measure = [&](const std::string& what, std::span<const Term> terms) {
        const Pair pair = measure_pair(
            rounds, CLOCK_THREAD_CPUTIME_ID,
            [&] {
              for (const Term term : terms)
                renderer.add_gradient(term, adjoint, {.seed = 3, .pass = 1}, {0, c.samples}, gradient);
              return 1.0;
            },
            [&] {
              renderer.render({.seed = 3}, {0, c.samples});
              return 1.0;
            });
        report.add(what + " gradient / render",
                   s.name + " " + c.name + (vertices ? " all vertices" : " one translation"), pair.ratio, "", "<= 3");
      };
      for (const Term& term : kTerms)
        if (renderer.has(term)) measure(name(term), std::span(&term, 1));
      measure("whole", kTerms);  // a term that is zero costs nothing
    }
  }
}

/// CPU time of bare Embree for the rays of a rendering of the first scene over that for the second: what no renderer can
/// better that traces its rays one by one.
void measure_bare(const std::string& figure, const Scene& first, const Scene& second, int rounds, Report& report) {
  struct Side {
    PreparedScene prepared;
    std::vector<RecordedRay> rays;
    explicit Side(const Scene& scene)
        : prepared(scene, nullptr), rays(record_rays(prepared, wide_gates(), 3, kSamples.count())) {}
    double trace() const {
      trace_bare(prepared.caster.embree_scene(), rays);
      return static_cast<double>(rays.size());
    }
  };
  const Side a(first), b(second);
  const Pair pair = measure_pair(
      rounds, CLOCK_THREAD_CPUTIME_ID, [&] { return a.trace(); }, [&] { return b.trace(); });
  report.add(figure, "Embree alone", pair.ratio, "");
}

/// CPU time of the primal and the interior pass with the first scene, gates and basis over that with the
/// second.
struct Load {
  const Scene& scene;
  const GateSet& gates;
  const TangentBasis& basis;
};
void measure_load(const std::string& figure, const std::string& what, Sampling sampling, const Load& first,
                  const Load& second, int rounds, const char* goal, Report& report) {
  const EstimatorOptions options{.max_bounces = 3, .sampling = sampling};
  const SampleRange samples{0, sampling == Sampling::ellipsoidal ? 8 : 64};
  struct Side {
    Renderer renderer;
    GatedImage adjoint;
    std::vector<double> gradient;
    Side(const Load& load, const EstimatorOptions& o)
        : renderer(load.scene, load.gates, o, &load.basis),
          adjoint(unit_adjoint(load.scene, load.gates)),
          gradient(DofLayout(load.scene).size()) {}
  };
  Side a(first, options), b(second, options);
  const auto pair = [&](auto&& work) {
    return measure_pair(
               rounds, CLOCK_THREAD_CPUTIME_ID, [&] { return work(a), 1.0; }, [&] { return work(b), 1.0; })
        .ratio;
  };
  report.add(figure, what + " render", pair([&](Side& s) { s.renderer.render({.seed = 3}, samples); }), "", goal);
  report.add(figure, what + " interior gradient", pair([&](Side& s) {
               s.renderer.add_gradient(Term::interior, s.adjoint, {.seed = 3, .pass = 1}, samples, s.gradient);
             }),
             "", goal);
}

/// What more unknowns, gates and triangles cost.
void measure_loads(int rounds, Report& report) {
  const Scene small = small_scene(), large = large_scene(), coarse = subdivided(small, 6),
              fine = subdivided(small, 204);
  const GateSet wide = wide_gates(), narrow = narrow_gates();
  std::vector<double> centers;
  for (int g = 0; g < 256; ++g) centers.push_back(5 + 4.5 * g / 255);
  // The one gate reaches as far as all of the others, so that the same paths count.
  const GateShape narrow_shape = GateShape::gaussian(0.05);
  const double wider = (2.25 + narrow_shape.upper()) / narrow_shape.upper();
  const GateSet many(narrow_shape, centers), one(GateShape::gaussian(0.05 * wider), {7.25});
  const std::string a_million =
      std::to_string(fine.triangles.size()) + " triangles / " + std::to_string(coarse.triangles.size());
  measure_bare(a_million, fine, coarse, std::min(rounds, 5), report);
  for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
    const bool standard = sampling == Sampling::standard;
    const std::string how = standard ? "standard" : "ellipsoidal";
    const GateSet& gates = standard ? wide : narrow;
    const TangentBasis free = all_vertices(large), shift = translation(large);
    measure_load("105 000 unknowns / one", how, sampling, {large, gates, free}, {large, gates, shift}, rounds, "<= 1.3",
                 report);
    const TangentBasis box = translation(small);
    measure_load("256 gates / one", how, sampling, {small, many, box}, {small, one, box}, rounds, "<= 1.5", report);
    const TangentBasis of_fine = translation(fine), of_coarse = translation(coarse);
    measure_load(a_million, how, sampling, {fine, gates, of_fine}, {coarse, gates, of_coarse}, std::min(rounds, 5),
                 "<= 3", report);
  }
}

/// Wall time with one thread over that with two: of the least times, which other programs on the machine's cores have no
/// part in, and in the median, which they do. And how much of the two threads' time is spent at work.
void measure_threads(const NamedScene& s, int rounds, Report& report) {
  const TangentBasis basis = all_vertices(s.scene);
  const GateSet gates = wide_gates();
  const Renderer renderer(s.scene, gates, {.max_bounces = 8, .sampling = Sampling::standard}, &basis);
  const GatedImage adjoint = unit_adjoint(s.scene, gates);
  std::vector<double> gradient(DofLayout(s.scene).size());
  const auto add = [&](const std::string& what, const char* goal, const std::function<void()>& work) {
    std::vector<double> busy;
    const auto with_one = [&] {
      set_thread_count(1);
      work();
      return 1.0;
    };
    const auto with_two = [&] {
      set_thread_count(2);
      const double wall = seconds(CLOCK_MONOTONIC), cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
      work();
      busy.push_back((seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu) / (2 * (seconds(CLOCK_MONOTONIC) - wall)));
      return 1.0;
    };
    const Pair pair = measure_pair(rounds, CLOCK_MONOTONIC, with_one, with_two);
    report.add("one thread / two (least times)", s.name + " " + what, pair.least_ratio, "", goal);
    report.add("one thread / two (median)", s.name + " " + what, pair.ratio, "");
    report.add("two threads at work", s.name + " " + what, median(busy), "of their time");
  };
  const SampleRange samples{0, 64};
  // What the machine's second core is worth at the time.
  const PreparedScene prepared(s.scene, nullptr);
  const auto rays = record_rays(prepared, gates, 8, samples.count());
  constexpr int kParts = 64;
  add("Embree alone", "", [&] {
    parallel(kParts, [&](int part) {
      const std::size_t begin = rays.size() * part / kParts, end = rays.size() * (part + 1) / kParts;
      trace_bare(prepared.caster.embree_scene(), std::span(rays).subspan(begin, end - begin));
    });
  });
  add("render", ">= 1.9", [&] { renderer.render({.seed = 3}, samples); });
  add("interior gradient", ">= 1.9",
      [&] { renderer.add_gradient(Term::interior, adjoint, {.seed = 3, .pass = 1}, samples, gradient); });
  set_thread_count(1);
}

}  // namespace
}  // namespace isochron::benchmarks

int main(int argc, char** argv) {
  using namespace isochron::benchmarks;
  const int rounds = argc > 2 ? std::atoi(argv[2]) : 15;
  if (argc < 2 || argc > 3 || argv[1][0] == '-' || rounds < 1) {
    std::fprintf(stderr, "usage: isochron_measure CSV [ROUNDS]\n");
    return 2;
  }
  isochron::set_thread_count(1);
  isochron::keep_freed_memory();
  Report report(argv[1]);
  const std::vector<NamedScene> scenes{{"small", small_scene()}, {"large", large_scene()}};
  for (const NamedScene& s : scenes) measure_forward(s, rounds, report);
  for (const NamedScene& s : scenes) measure_gradient(s, rounds, report);
  measure_loads(rounds, report);
  // Unlike the figures above, wall times need both cores. The load counts this program itself.
  if (double load; getloadavg(&load, 1) == 1 && load > 1.5)
    std::fprintf(stderr, "The machine is busy (load %.1f): the figures for threads are not worth much.\n", load);
  for (const NamedScene& s : scenes) measure_threads(s, rounds, report);
}
