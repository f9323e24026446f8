// Guiding of the visibility term: its histograms against their densities, and guided against unguided estimates.
// Chi-square tests fail by chance with probability 1e-4, z-tests at 4.5 standard errors with 7e-6; seeds are fixed.
#include "core/techniques/boundary_guide.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "core/base/random.h"
#include "core/films/sinks.h"
#include "core/techniques/boundary_edges.h"
#include "tests/render/support.h"
#include "tests/seed.h"

namespace isochron::testing {
namespace {

/// Bins from 1/100 to about twice the average.
Warp uneven_warp(int bins) {
  std::vector<double> p(bins);
  double sum = 0;
  for (int i = 0; i < bins; ++i) sum += p[i] = 1.01 + std::sin(2.0 * i);
  for (double& x : p) x /= sum;
  return Warp(p);
}

TEST(Warp, InvertsItsDistribution) {
  for (const int bins : {1, 2, 64, 512}) {
    const Warp warp = bins == 1 ? Warp() : uneven_warp(bins);
    EXPECT_NEAR(warp.below(1), 1, 1e-12);
    for (int i = 0; i < 4000; ++i) {
      const double u = (i + 0.5) / 4000, x = warp.sample(u), h = 1e-7;
      EXPECT_NEAR(warp.below(x), u, 1e-12);
      const double slope = (warp.below(x + h) - warp.below(x - h)) / (2 * h);
      const bool inside = std::floor((x + h) * bins) == std::floor((x - h) * bins);
      if (inside) {
        EXPECT_NEAR(warp.density(x), slope, 1e-6);
      }
    }
  }
}

/// Four pieces of every edge: how often they come up, against the integral of the density that estimates divide by.
TEST(BoundaryGuide, EdgePointsFollowTheirDensity) {
  const Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  const TangentBasis basis = make_basis(scene, {translate(scene, "block", {0, 1, 0})});
  const PreparedScene prepared(scene, &basis);
  const BoundaryEdges edges(prepared);
  const Warp warp = uneven_warp(64);
  for (const bool primary : {false, true}) {
    struct Cell {
      double expected = 0;
      int count = 0;
    };
    std::map<std::pair<const BoundaryEdge*, int>, Cell> cells;
    const auto draw = [&](double x) { return primary ? edges.sample_primary(x) : edges.sample_secondary(x); };
    // By quadrature over the number that picks edge and point, in the measure of length.
    const int steps = 1 << 20;
    for (int i = 0; i < steps; ++i) {
      const BoundaryEdges::Sample s = draw((i + 0.5) / steps);
      const double length_of_step = length(s.edge->end - s.edge->origin) / s.share / steps;
      EXPECT_NEAR(s.x(), (i + 0.5) / steps, 1e-12);
      cells[{s.edge, static_cast<int>(4 * s.s)}].expected += s.pdf * warp.density(s.x()) * length_of_step;
    }
    const int n = 400000;
    Rng rng(Stream{17, 0, 0}, primary, 0);
    for (int i = 0; i < n; ++i) {
      const BoundaryEdges::Sample s = draw(warp.sample(rng.uniform()));
      ++cells[{s.edge, static_cast<int>(4 * s.s)}].count;
    }
    double chi_square = 0, total = 0;
    int freedom = -1;
    for (const auto& [key, cell] : cells) {
      total += cell.expected;
      if (n * cell.expected < 5) continue;
      const double d = cell.count - n * cell.expected;
      chi_square += d * d / (n * cell.expected);
      ++freedom;
    }
    EXPECT_NEAR(total, 1, 1e-4);
    EXPECT_GT(freedom, 30);
    // Wilson and Hilferty's approximation of the quantile at 1 - 1e-4.
    const double f = 2.0 / (9 * freedom);
    EXPECT_LT(chi_square, freedom * std::pow(1 - f + 3.719 * std::sqrt(f), 3)) << freedom;
  }
}

/// Learned from contributions at one end: draws go there, and nowhere is left out.
TEST(BoundaryGuide, LearnsWhereContributionsAre) {
  std::vector<GuideRecord> records;
  for (int i = 0; i < 1000; ++i)
    records.push_back({BoundaryGuide::table(Technique::from_edge), 0.25 * (i + 0.5) / 1000, 1});
  for (int i = 0; i < 10; ++i) records.push_back({BoundaryGuide::table(Technique::primary_edge), 0.5, 4});
  const BoundaryGuide guide({true, false, true, false, true}, records, {1, 0, 4, 0, 5});
  const Warp& warp = guide.warp(BoundaryGuide::table(Technique::from_edge));
  EXPECT_GT(warp.below(0.25), 0.75);
  for (int i = 0; i < 100; ++i) EXPECT_GT(warp.density((i + 0.5) / 100), 0.2);
  // Three techniques are possible: without guiding each has a rate of 1/3. Rates for the same total cost of 10/3: in
  // proportion to the roots of second moment over cost. Guided moments are those of the records over their densities. 10
  // and 1000 records make 10 / 18 and about 1000 / 1008 of that, on a logarithmic scale. The last one, which finds
  // nothing, is rarely used.
  double moment = 0;
  for (const GuideRecord& r : records)
    if (r.table == BoundaryGuide::table(Technique::from_edge)) moment += r.square / warp.density(r.x);
  EXPECT_LT(moment, 400);
  const double of_primary = std::sqrt(40 / guide.warp(BoundaryGuide::table(Technique::primary_edge)).density(0.5)),
               of_edge = std::sqrt(moment / 4), scale = 10 / (of_primary + 4 * of_edge);
  EXPECT_NEAR(guide.rate(Technique::primary_edge), std::pow(of_primary * scale, 10.0 / 18) / 3, 1e-12);
  EXPECT_NEAR(guide.rate(Technique::from_edge), std::pow(of_edge * scale, 1000.0 / 1008) / 3, 1e-3);
  EXPECT_NEAR(guide.rate(Technique::from_camera), std::pow(0.125, 1000.0 / 1008) / 3, 1e-3);
  EXPECT_EQ(guide.rate(Technique::pixel_border), 0);
}

/// Rates of searches that find the same segments, against a search over all rates of the same cost.
TEST(BoundaryGuide, SharesSegmentsAtTheLeastVariance) {
  constexpr BoundaryGuide::Each<double> kCost{0, 0, 2000, 0, 3000};
  std::vector<GuideRecord> records;
  Rng rng(Stream{test_seed(18), 0, 0}, 0, 0);
  for (int i = 0; i < 4000; ++i) {
    const double p = rng.uniform();
    const Technique found_by = rng.uniform() < p ? Technique::from_camera : Technique::from_edge;
    const double u = rng.uniform();
    records.push_back({BoundaryGuide::table(found_by), found_by == Technique::from_edge ? u * u : std::sqrt(u),
                       0.5 + rng.uniform() * p, p});
  }
  const BoundaryGuide guide({false, false, true, false, true}, records, kCost);
  const auto variance = [&](double edge, double camera) {
    double sum = 0;
    for (const GuideRecord& r : records)
      sum +=
          r.square / ((1 - r.camera_part) * edge * guide.warp(BoundaryGuide::table(Technique::from_edge)).density(r.x) +
                      r.camera_part * camera * guide.warp(BoundaryGuide::table(Technique::from_camera)).density(r.x));
    return sum;
  };
  double best = 0, least = std::numeric_limits<double>::infinity();
  for (int i = 1; i < 5000; ++i) {
    const double edge = i * 0.0005, camera = (5000 - edge * 2000) / 3000;
    if (const double v = variance(edge, camera); v < least) least = v, best = edge / camera;
  }
  EXPECT_NEAR(guide.rate(Technique::from_edge) / guide.rate(Technique::from_camera) / best, 1, 0.02);
  // Where the camera finds nothing of its own, and at more cost, it is hardly asked.
  for (GuideRecord& r : records) r.camera_part = 0.5, r.x = rng.uniform();
  const BoundaryGuide alike({false, false, true, false, true}, records, {0, 0, 2000, 0, 12000});
  EXPECT_NEAR(alike.rate(Technique::from_camera), 0.125 / 2, 0.001);
}

/// What one sample adds to one value of an image counts by the square of its sum, the rest by the sum of its squares; with
/// several unknowns, on average.
TEST(BoundaryGuide, SinkSumsBeforeItSquares) {
  const Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  const GateSet gates(GateShape::boxcar(1), {5.0, 7.0});  // one at 5, the other at 7
  const DofLayout layout(scene);
  LocalDifferential differential;
  differential.vertices.push_back(
      {scene.triangles[scene.shapes[scene.find_shape("block")].first_triangle].vertex[0], {0, 2, 1}, {}});
  for (const int columns : {1, 2}) {
    std::vector<Motion> motions{translate(scene, "block", {0, 1, 0})};
    if (columns == 2) motions.push_back(translate(scene, "block", {0, 0, 3}));
    const TangentBasis basis = make_basis(scene, motions);
    GuideSink sink(gates, layout, basis);
    const int samples = columns == 1 ? 1 : 4096;
    for (int i = 0; i < samples; ++i) {
      sink.bind(differential);
      sink.add(3, Rgb(1, 0, 0), 5, GateUse::value_only);
      sink.add(3, Rgb(-0.5, 0, 0), 5, GateUse::value_only);
      sink.add(3, Rgb(0, 4, 0), 7, GateUse::value_only);
      sink.add(4, Rgb(0, 0, -2), 5, GateUse::value_only);
      sink.note_guide(BoundaryGuide::table(Technique::primary_edge), 0.5);
    }
    double mean = 0;
    for (const GuideRecord& r : sink.records) mean += r.square / samples;
    // Rates 2 and 3 for the two columns; a record is (0.25 + 16 + 4) (2 +- 3)^2, of standard deviation 12 (20.25).
    EXPECT_NEAR(mean, 20.25 * (columns == 1 ? 4 : 13), columns == 1 ? 1e-12 : 4.5 * 12 * 20.25 / 64) << columns;
  }
}

TEST(BoundaryGuide, LearnsNothingFromNothing) {
  const BoundaryGuide guide({true, true, true, false, true}, {}, {1, 1, 1, 0, 1});
  EXPECT_EQ(guide.rate(Technique::primary_edge), 0.25);
  EXPECT_EQ(guide.warp(0).density(0.3), 1);
}

class Guided : public ::testing::TestWithParam<Sampling> {};

/// The visibility term: means over the image, [unknown][gate], and how far single readings of a batch are from their mean, the
/// sum of all distances. A few rare samples say less in it than in a variance.
struct VisibilityTerm {
  std::vector<std::vector<Estimate>> means;
  double scatter = 0;
};

VisibilityTerm visibility_term(const Renderer& renderer, int columns, int gates, Stream stream) {
  constexpr int kSamples = 96, kBatches = 32;
  std::vector<std::vector<Batches>> sums(columns, std::vector<Batches>(gates));
  std::vector<std::vector<GatedImage>> batches;
  for (int b = 0; b < kBatches; ++b) {
    batches.push_back(renderer.derive(Term::visibility, stream, {b * kSamples, (b + 1) * kSamples}));
    for (int c = 0; c < columns; ++c)
      for (int g = 0; g < gates; ++g) sums[c][g].add(batches[b][c].mean(g));
  }
  VisibilityTerm result;
  for (int c = 0; c < columns; ++c) {
    auto& means = result.means.emplace_back();
    for (const Batches& gate : sums[c]) means.push_back(gate.estimate());
    for (std::size_t i = 0; i < batches[0][c].data.size(); ++i) {
      double mean = 0;
      for (const auto& batch : batches) mean += batch[c].data[i] / kBatches;
      for (const auto& batch : batches) result.scatter += std::abs(batch[c].data[i] - mean);
    }
  }
  return result;
}

TEST_P(Guided, MeansAgreeWithUnguidedOnes) {
  const Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  const bool narrow = GetParam() == Sampling::ellipsoidal;
  const GateSet gates(GateShape::gaussian(narrow ? 0.02 : 0.3), {5.0, 6.0});
  const TangentBasis basis =
      make_basis(scene, {translate(scene, "block", {0.3, 1, 0.2}), translate(scene, "light", {0.4, 0, 0.3}),
                         translate(scene, "panel", {-1, 0.2, 0.1})});
  constexpr int kSeeds = 4;
  double scatter[2] = {0, 0};
  for (unsigned seed = 41; seed < 41 + 2 * kSeeds; seed += 2) {
    VisibilityTerm found[2];
    for (const bool guided : {false, true}) {
      EstimatorOptions options{.max_bounces = 3, .sampling = GetParam()};
      options.guiding_samples = guided ? 16 : 0;
      const Renderer renderer(scene, gates, options, &basis);
      found[guided] = visibility_term(renderer, 3, 2, {seed + !guided, 0, 0});
      scatter[guided] += found[guided].scatter;
    }
    for (int c = 0; c < 3; ++c)
      for (int g = 0; g < 2; ++g) {
        const Estimate &plain = found[0].means[c][g], &guided = found[1].means[c][g];
        EXPECT_LT(std::abs(z_score(plain, guided)), 4.5)
            << c << " " << g << ": " << plain.mean << " +- " << plain.standard_error << ", guided " << guided.mean
            << " +- " << guided.standard_error;
      }
  }
  // For the same work. Of four seeds: 0.67 to 0.70 (standard; their sum under other test seeds 0.69 to 0.73), 0.79 to 1.12 (ellipsoidal,
  // mean 0.94, standard error 0.07). A guide that does nothing has 1: the first limit lies half way to it, the other, which only
  // forbids harm, four standard errors above the mean.
  EXPECT_LT(scatter[1], (narrow ? 1.2 : 0.84) * scatter[0]);
}

INSTANTIATE_TEST_SUITE_P(, Guided, ::testing::Values(Sampling::standard, Sampling::ellipsoidal), [](const auto& test) {
  return std::string(test.param == Sampling::standard ? "Standard" : "Ellipsoidal");
});

}  // namespace
}  // namespace isochron::testing
