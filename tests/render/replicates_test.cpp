// Replicates that are rendered together are those that are rendered one by one, in their bits; for any number of threads.
#include <gtest/gtest.h>

#include "core/base/parallel.h"
#include "support.h"

namespace isochron::testing {
namespace {

constexpr Stream kReplicated{.seed = 4};
const std::vector<SampleRange> kRanges = {{0, 3}, {3, 5}, {5, 8}};

/// Few gates, whose sums are all kept, and so many that they are listed.
class Replicates : public ::testing::TestWithParam<std::tuple<Sampling, int>> {
 protected:
  Replicates()
      : scene_(load_scene(TEST_DATA "/validation/scene.yaml")),
        gates_(gates()),
        basis_(
            make_basis(scene_, {translate(scene_, "block", {0.5, 0, 1}), change_material(scene_, "grey", "albedo")})),
        renderer_(scene_, gates_, {.max_bounces = 2, .sampling = std::get<0>(GetParam()), .guiding_samples = 1.2},
                  &basis_) {}
  ~Replicates() override { set_thread_count(0); }

  static GateSet gates() {
    const int count = std::get<1>(GetParam());
    std::vector<double> centers;
    for (int i = 0; i < count; ++i) centers.push_back(4.5 + 2.0 * (i + 0.5) / count);
    return {GateShape::boxcar(2.0 / count), centers};
  }

  /// What each image is the mean of, and what is told of its gates.
  static void expect_mean_of(const ReplicatedImage& found, const std::vector<GatedImage>& replicates) {
    const std::vector<double>& weight = found.gates.weight();
    ASSERT_EQ(weight, (std::vector<double>{0.375, 0.25, 0.375}));
    GatedImage mean(replicates[0].width, replicates[0].height, replicates[0].gates, replicates[0].channels);
    for (std::size_t r = 0; r < replicates.size(); ++r)
      for (std::size_t i = 0; i < mean.data.size(); ++i) mean.data[i] += weight[r] * replicates[r].data[i];
    EXPECT_EQ(found.mean.to_gated().data, StoredImage(mean).to_gated().data);
    for (int g = 0; g < mean.gates; ++g) {
      double size = 0;
      for (std::size_t r = 0; r < replicates.size(); ++r) {
        const double sum = replicates[r].mean(g) * mean.pixels();
        size += std::abs(sum);
        EXPECT_NEAR(found.gates.sum(g, r), sum, 1e-9 * size) << g << ", " << r;
      }
      Deviations expected;
      for (int pixel = 0; pixel < mean.pixels(); ++pixel)
        expected.add(weight, [&](std::size_t r) {
          double sum = 0;
          for (int c = 0; c < mean.channels; ++c) sum += replicates[r].at(pixel, g, c);
          return sum / mean.channels;
        });
      EXPECT_NEAR(found.gates.deviations(g).squares, expected.squares, 1e-9 * expected.squares) << g;
    }
  }

  Scene scene_;
  GateSet gates_;
  TangentBasis basis_;
  Renderer renderer_;
};

TEST_P(Replicates, AreThoseOfEachRange) {
  std::vector<GatedImage> images;
  for (const SampleRange& range : kRanges) images.push_back(renderer_.render(kReplicated, range));
  expect_mean_of(renderer_.render_replicates(kReplicated, kRanges), images);
  for (const Term term : kTerms) {
    const std::vector<ReplicatedImage> found = renderer_.derive_replicates(term, kReplicated, kRanges);
    std::vector<std::vector<GatedImage>> columns(found.size());
    for (const SampleRange& range : kRanges) {
      std::vector<GatedImage> derived = renderer_.derive(term, kReplicated, range);
      ASSERT_EQ(derived.size(), found.size());
      for (std::size_t i = 0; i < derived.size(); ++i) columns[i].push_back(std::move(derived[i]));
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      SCOPED_TRACE(::testing::Message() << "term " << static_cast<int>(term) << ", column " << i);
      expect_mean_of(found[i], columns[i]);
    }
  }
}

TEST_P(Replicates, DoNotDependOnThreads) {
  const auto all = [&] {
    std::vector<double> numbers;
    const auto append = [&](const ReplicatedImage& image) {
      const GatedImage mean = image.mean.to_gated();
      numbers.insert(numbers.end(), mean.data.begin(), mean.data.end());
      for (int g = 0; g < image.gates.gates(); ++g) {
        for (std::size_t r = 0; r < kRanges.size(); ++r) numbers.push_back(image.gates.sum(g, r));
        numbers.push_back(image.gates.deviations(g).squares);
        numbers.push_back(static_cast<double>(image.gates.deviations(g).fourth_powers));
      }
    };
    append(renderer_.render_replicates(kReplicated, kRanges));
    for (const Term term : kTerms)
      for (const ReplicatedImage& image : renderer_.derive_replicates(term, kReplicated, kRanges)) append(image);
    return numbers;
  };
  set_thread_count(1);
  const std::vector<double> alone = all();
  for (const int threads : {2, 5}) {
    set_thread_count(threads);
    EXPECT_EQ(all(), alone) << threads;
  }
}

INSTANTIATE_TEST_SUITE_P(All, Replicates,
                         ::testing::Combine(::testing::Values(Sampling::standard, Sampling::ellipsoidal),
                                            ::testing::Values(4, 700)));

}  // namespace
}  // namespace isochron::testing
