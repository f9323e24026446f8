// Which samples a technique takes, where its points lie together, and what that gains.
#include "core/techniques/sample_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "core/techniques/gate_pick.h"
#include "scene_building.h"
#include "support.h"

namespace isochron::testing {
namespace {

constexpr Stream kStream{5, 2, 1};
constexpr int kImage = GatePick::kImage;

/// First numbers of so many samples, on average, that come with each of the pixels [begin, end).
std::vector<double> numbers_of(const PointSet& set, int begin, int end, double count, SamplePart part = {}) {
  std::vector<double> numbers;
  for (int pixel = begin; pixel < end; ++pixel)
    set.visit(count, pixel, part, [&](Rng& rng) { numbers.push_back(rng.uniform()); });
  return numbers;
}

TEST(PointSet, PixelsOfAnImageShareOneSet) {
  // 512 samples, however many pixels they come with: one in each of as many intervals.
  for (const double rate : {1.0, 0.5, 0.125}) {
    const int pixels = static_cast<int>(128 / rate);
    std::set<int> intervals;
    for (const double x :
         numbers_of({kStream, Technique::from_edge, kImage, {3, 7}, Numbers::low_discrepancy}, 0, pixels, rate * 4))
      intervals.insert(static_cast<int>(x * 512));
    EXPECT_EQ(intervals.size(), 512u) << rate;
  }
}

TEST(PointSet, EverySampleHasNumbersOfItsOwn) {
  for (const Numbers numbers : {Numbers::low_discrepancy, Numbers::independent}) {
    std::set<double> all;
    std::size_t count = 0;
    const auto add = [&](const std::vector<double>& some) {
      all.insert(some.begin(), some.end()), count += some.size();
    };
    for (const SampleRange range : {SampleRange{0, 4}, SampleRange{4, 8}})
      for (const Technique technique : {Technique::primary_edge, Technique::from_edge}) {
        add(numbers_of({kStream, technique, kImage, range, numbers}, 0, 20, 1.7 * 4));
        for (int pixel = 0; pixel < 20; ++pixel)
          add(numbers_of({kStream, technique, pixel, range, numbers}, 0, 1, 1.7 * 4));
      }
    EXPECT_EQ(all.size(), count);  // 1100 numbers of 32 bits: two are equal by chance in 1e-4 of such sets
    EXPECT_NEAR(static_cast<double>(count), 2 * 2 * 2 * 20 * 4 * 1.7, 90);
  }
}

/// Beyond what 32 bits count, points do not come again: each 256 that belong to a pixel cover as many intervals, and differ from
/// those of all other pixels. (Of 3000 numbers of 32 bits two are equal by chance in 1e-3 of such sets, and 256 independent
/// ones never have an interval each.)
TEST(PointSet, SetsGoOnBeyondThirtyTwoBits) {
  constexpr int kSamples = 256, kPixels = 1 << 24;  // times kSamples: 2^32 points
  for (const Numbers numbers : {Numbers::low_discrepancy, Numbers::independent}) {
    const PointSet points(kStream, Technique::from_edge, kImage, {0, kSamples}, numbers);
    std::set<double> all;
    std::size_t count = 0;
    for (const int begin : {0, kPixels / 2, kPixels, 3 * kPixels, 5 * kPixels})
      for (int pixel = std::max(0, begin - 1); pixel <= begin + 1; ++pixel) {
        std::set<int> intervals;
        for (const double x : numbers_of(points, pixel, pixel + 1, kSamples)) {
          intervals.insert(static_cast<int>(x * kSamples));
          all.insert(x);
          ++count;
        }
        if (numbers == Numbers::low_discrepancy) {
          EXPECT_EQ(intervals.size(), std::size_t{kSamples}) << pixel;
        }
      }
    EXPECT_EQ(all.size(), count);
  }
}

TEST(PointSet, PartsMakeUpTheWhole) {
  for (const double rate : {1.0, 1.7, 0.4}) {
    constexpr int kParts = 3, kPixel = 6;
    const auto numbers = [&](SamplePart part) {
      const auto set = [](Technique technique, int place) {
        return PointSet(kStream, technique, place, {3, 10}, Numbers::low_discrepancy);
      };
      std::vector<double> all = numbers_of(set(Technique::walk, kPixel), 0, 1, rate * 7, part);
      const std::vector<double> more =
          numbers_of(set(Technique::from_edge, kImage), kPixel, kPixel + 1, rate * 7, part);
      all.insert(all.end(), more.begin(), more.end());
      std::sort(all.begin(), all.end());
      return all;
    };
    std::vector<double> united;
    for (int i = 0; i < kParts; ++i) {
      const std::vector<double> part = numbers({i, kParts});
      EXPECT_LT(part.size(), numbers({}).size());
      united.insert(united.end(), part.begin(), part.end());
    }
    std::sort(united.begin(), united.end());
    EXPECT_EQ(united, numbers({})) << rate;
  }
}

TEST(PointSet, FractionalRatesHoldOnAverage) {
  // 2.3 samples on average, by a shift that is uniform over the sets: 2 or 3, with a deviation of 0.46, so over 4000 sets
  // within 0.033 of the mean at 4.5 deviations (false alarm 7e-6 each).
  constexpr int kSets = 4000;
  double in_pixel = 0, in_image = 0;
  for (int i = 0; i < kSets; ++i) {
    const auto count = [&](int place, int turn) {
      const PointSet set({1, static_cast<std::uint32_t>(i), 0}, Technique::walk, place, {0, 1},
                         Numbers::low_discrepancy);
      return static_cast<double>(numbers_of(set, turn, turn + 1, 2.3).size());
    };
    in_pixel += count(7, 0);
    in_image += count(kImage, 5);
  }
  EXPECT_NEAR(in_pixel / kSets, 2.3, 0.033);
  EXPECT_NEAR(in_image / kSets, 2.3, 0.033);
}

// A plate under a lamp rises; under a narrow gate connections of the camera find the light, boundary segments the lamp's
// rim. Variance over 64 sets of the sum over the image of the derivative: each is known to 18 %. It falls 4.1 times for the
// interior term, 38 times for the visibility term.
TEST(PointSet, SumsOverTheImageVaryLess) {
  Scene scene;
  scene.camera = {{0, 1.5, 2}, {0, 0, 0}, {0, 1, 0}, 50, 16, 16};
  add_shape(scene, "plate", quad({-0.5, 0, 0.5}, {0.5, 0, 0.5}, {0.5, 0, -0.5}, {-0.5, 0, -0.5}),
            conductor(Rgb(0.8), 0.4));
  add_shape(scene, "lamp", quad({-0.3, 2, -0.3}, {0.3, 2, -0.3}, {0.3, 2, 0.3}, {-0.3, 2, 0.3}), diffuse(Rgb(0.0)),
            Rgb(10.0));
  const TangentBasis basis = make_basis(scene, {translate(scene, "plate", {0, 1, 0})});
  const GateSet gates(GateShape::gaussian(0.02), {4.4});
  const auto variance = [&](Term term, Numbers numbers) {
    const Renderer renderer(scene, gates, {.max_bounces = 1, .sampling = Sampling::ellipsoidal, .numbers = numbers},
                            &basis);
    double sum = 0, squares = 0;
    constexpr int kSets = 64;
    for (std::uint32_t i = 0; i < kSets; ++i) {
      double total = 0;
      const auto images = renderer.derive(term, {1, i, 0}, {0, samples_of(term, 4)});
      for (const double x : images[0].data) total += x;
      sum += total, squares += total * total;
    }
    return squares / kSets - sum * sum / (kSets * kSets);
  };
  const auto gain = [&](Term term) {
    return variance(term, Numbers::independent) / variance(term, Numbers::low_discrepancy);
  };
  EXPECT_GT(gain(Term::interior), 2);
  EXPECT_GT(gain(Term::visibility), 15);
}

}  // namespace
}  // namespace isochron::testing
