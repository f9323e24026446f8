// Which readings count: windows, masks, and what of them is refused.
#include "optim/problem/readings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/image/npy.h"
#include "optim/problem/photon_noise.h"
#include "optim/problem/problem.h"
#include "optim/problem/rendered_objective.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

/// A file as numpy.save writes it.
std::string npy(const std::string& type, bool fortran, const std::string& shape, const std::string& elements) {
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': " + (fortran ? "True" : "False") + ", 'shape': (" + shape + "), }";
  header.resize(118 - 1, ' ');
  return std::string("\x93NUMPY\x01\x00", 8) + char(118) + char(0) + header + "\n" + elements;
}

std::string message(const auto& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Npy, BothOrdersAndAllTypes) {
  const TemporaryFolder folder;
  const auto values = [&](const std::string& contents) { return read_npy(folder.write("a.npy", contents)).values; };
  EXPECT_EQ(values(npy("|b1", false, "2, 3", std::string("\1\0\0\0\1\0", 6))), (std::vector<double>{1, 0, 0, 0, 1, 0}));
  EXPECT_EQ(values(npy("|u1", true, "2, 3", "\1\2\3\4\5\6")), (std::vector<double>{1, 3, 5, 2, 4, 6}));
  EXPECT_EQ(values(npy("<i2", false, "1,", std::string("\xfe\xff", 2))), (std::vector<double>{-2}));
  EXPECT_EQ(values(npy("<f4", false, "", std::string("\0\0\x40\x40", 4))), (std::vector<double>{3}));
  EXPECT_EQ(read_npy(folder.file("a.npy")).shape.size(), 0u);
  EXPECT_EQ(values(npy("<f8", false, "0, 3", "")), std::vector<double>());
}

TEST(Npy, PixelsAreWrittenByColumnAndRow) {
  const TemporaryFolder folder;
  const std::string contents = npy_of_pixels(3, 2, {1, 2, 3, 4, 5, 6});
  EXPECT_EQ((contents.size() - 6) % 64, 0u) << "elements are aligned";
  const NumberArray array = read_npy(folder.write("a.npy", contents));
  EXPECT_EQ(array.shape, (std::vector<std::size_t>{3, 2}));
  EXPECT_EQ(array.values, (std::vector<double>{1, 4, 2, 5, 3, 6}));
}

TEST(Npy, SaysWhatIsAmiss) {
  const TemporaryFolder folder;
  const auto said = [&](const std::string& contents) {
    const std::string file = folder.write("a.npy", contents);
    const std::string text = message([&] { read_npy(file); });
    EXPECT_TRUE(text.starts_with(file + ": ")) << text;
    return text.substr(std::min(text.size(), file.size() + 2));
  };
  EXPECT_EQ(said("hello"), "is no NumPy array (allowed: .npy as numpy.save writes it)");
  EXPECT_EQ(said(npy("|b1", false, "2", "").substr(0, 40)),
            "is no NumPy array (allowed: .npy as numpy.save writes it)");
  for (const char* type : {">f8", "<c16", "|O", ""})
    EXPECT_TRUE(said(npy(type, false, "1", "12345678")).starts_with("holds elements of type '")) << type;
  EXPECT_EQ(said(npy("\n\1", false, "1", "1")).find_first_of("\n\1"), std::string::npos);
  EXPECT_EQ(said(npy("<f8", false, "2, 2", "12345678")), "ends before its 2 x 2 elements");
  EXPECT_EQ(said(npy("|u1", false, "4294967296, 4294967296, 4294967296", "1")),
            "ends before its 4294967296 x 4294967296 x 4294967296 elements");
  EXPECT_EQ(said(npy("|u1", false, "-1", "1")), "its header cannot be read");
}

class ReadingsOfTiny : public testing::Test {
 protected:
  ReadingsOfTiny() {
    write_tiny_scene(folder_);
    file_ = folder_.write("tiny.yaml", tiny_experiment());
    std::string left(64, '\0');  // [column, row]: columns 0 to 3
    std::fill_n(left.begin(), 32, '\1');
    folder_.write("left.npy", npy("|b1", false, "8, 8", left));
  }
  Experiment experiment(const std::vector<std::string>& overrides) const { return load_experiment(file_, overrides); }

  TemporaryFolder folder_;
  std::string file_;
};

TEST_F(ReadingsOfTiny, WindowAndMaskChoose) {
  const Problem problem(experiment({"target.window=[5, 6]", "target.mask=left.npy"}));
  const Readings& readings = problem.readings();
  EXPECT_EQ(readings.gate, (std::vector<char>{0, 1}));
  const GatedImage image(8, 8, 2, 1);
  EXPECT_EQ(readings.count(image), 32);
  EXPECT_EQ(readings.pixels(image), 32);
  for (int p = 0; p < 64; ++p) EXPECT_EQ(readings.uses_pixel(p), p % 8 < 4) << p;
}

TEST_F(ReadingsOfTiny, MaskRepeatsForEverySpot) {
  folder_.write("corner.npy", npy("|u1", true, "2, 3", std::string("\0\1\1\1\1\1", 6)));
  const Experiment e = experiment({"target.mask=corner.npy"});
  const Readings readings = make_readings(e, make_gates(e.gates), 2, 6, 2);
  for (int p = 0; p < 12; ++p) EXPECT_EQ(readings.uses_pixel(p), p != 0 && p != 6) << p;
}

// What is left out can hold anything.
TEST_F(ReadingsOfTiny, LossAndGradientAreThoseOfTheOthers) {
  for (const char* kind : {"{kind: squared}", "{kind: cauchy, scale: 0.3}", "{kind: poisson}"}) {
    const std::string loss = std::string("loss=") + kind;
    const Problem part(experiment({loss, "target.mask=left.npy"})), whole(experiment({loss}));
    GatedImage target = part.make_target(), other = target;
    for (int p = 0; p < 64; ++p)
      for (int g = 0; g < 2; ++g)
        if (p % 8 >= 4) target.at(p, g) = std::numeric_limits<double>::quiet_NaN(), other.at(p, g) = 0;
    const std::vector<double> theta = part.parameters().initial();
    const Evaluation at = RenderedObjective(part, target).linearise(theta, 0);
    EXPECT_TRUE(std::isfinite(at.loss) && std::isfinite(at.gradient[0]) && std::isfinite(at.curvature[0])) << kind;
    const Evaluation plain = RenderedObjective(part, other).linearise(theta, 0);
    EXPECT_EQ(at.loss, plain.loss);
    EXPECT_EQ(at.gradient, plain.gradient);
    EXPECT_EQ(at.curvature, plain.curvature);
    // Twice the mean over half of the readings is that over all of the left half's, where the others fit exactly.
    GatedImage fits = part.make_target();
    const SplitImage image{fits, GatedImage(8, 8, 2, 1), 0.5};
    for (int p = 0; p < 64; ++p)
      if (p % 8 < 4) fits.at(p, 0) *= 1.5;
    const ReadingLoss rho = part.reading_loss(fits);
    ReadingLoss all = rho;
    all.readings = {};
    EXPECT_NEAR(estimate_loss(image, fits, rho).value, 2 * estimate_loss(image, fits, all).value, 1e-12) << kind;
  }
}

TEST_F(ReadingsOfTiny, WhatCannotBeUsedIsRefused) {
  const auto said = [&](const std::vector<std::string>& overrides) {
    return message([&] { Problem problem(experiment(overrides)); });
  };
  EXPECT_NE(said({"target.window=[7, 8]"})
                .find("target.window: no gate has its centre within 7 to 8 (they lie at 4.5 to 5.5"),
            std::string::npos);
  EXPECT_NE(said({"target.window=[8, 7]"}).find("is not an interval"), std::string::npos);
  EXPECT_NE(said({"target.window=[1, 2]", "gates={kind: steady}"}).find("target.window: the steady sensor"),
            std::string::npos);
  folder_.write("small.npy", npy("|u1", false, "2, 3", "\1\1\1\1\1\1"));
  EXPECT_NE(
      said({"target.mask=small.npy"}).find("an array of [2, 3] (allowed: [8, 8], columns and rows of the images)"),
      std::string::npos);
  folder_.write("none.npy", npy("|u1", false, "8, 8", std::string(64, '\0')));
  EXPECT_NE(said({"target.mask=none.npy"}).find("leaves no pixel"), std::string::npos);
  EXPECT_NE(said({"target.noise={photons: 3, counts: true}"}).find("has to say how many"), std::string::npos);
}

TEST_F(ReadingsOfTiny, LikelihoodNeedsCounts) {
  const Problem problem(experiment({"loss={kind: poisson}", "target.mask=left.npy"}));
  GatedImage image(8, 8, 2, 1);
  image.at(7, 0) = -1;  // not used
  EXPECT_EQ(message([&] { problem.require_usable(image, "measured.exr"); }), "accepted");
  image.at(8 * 3 + 2, 1) = -0.5;
  EXPECT_TRUE(message([&] {
                problem.require_usable(image, "measured.exr");
              }).starts_with("measured.exr: -0.5 at column 2, row 3, gate 1 is no count (loss.kind: poisson"));
}

TEST_F(ReadingsOfTiny, RenderedTargetsBecomeCounts) {
  const Problem clean(experiment({"target.samples=64"})), counted(experiment({"target.noise={counts: true}"}));
  GatedImage expected = clean.make_target();
  draw_counts(expected, {7, 0, 6});
  const GatedImage counts = counted.make_target();
  EXPECT_EQ(counts.data, expected.data);
  for (double value : counts.data) EXPECT_EQ(value, std::floor(value));
}

// Runs of 30 pixels for 7 have 4 or 5: equally often all the same.
TEST(Readings, PixelsAreDrawnEquallyOftenAndSpreadEvenly) {
  for (const auto& [pixels, count] : {std::pair{30, 7}, {4096, 1024}, {100, 99}, {10, 1}}) {
    SCOPED_TRACE(std::to_string(count) + " of " + std::to_string(pixels));
    std::vector<int> drawn(pixels + 2, 0);
    constexpr std::uint32_t kNumbers = 2000;
    for (std::uint32_t number = 0; number < kNumbers; ++number) {
      Readings readings;
      readings.pixel.assign(pixels + 2, 1);
      readings.pixel[3] = readings.pixel[5] = 0;
      EXPECT_DOUBLE_EQ(choose_pixels(readings, pixels + 2, count, number), static_cast<double>(count) / pixels);
      EXPECT_EQ(std::accumulate(readings.pixel.begin(), readings.pixel.end(), 0), count);
      for (int p = 0; p < pixels + 2; ++p) drawn[p] += readings.pixel[p];
      int gap = 0, widest = 0;
      for (const char each : readings.pixel) widest = std::max(widest, gap = each ? 0 : gap + 1);
      EXPECT_LE(widest, 2 * (pixels + count - 1) / count + 2);
    }
    EXPECT_EQ(drawn[3] + drawn[5], 0);
    drawn.erase(drawn.begin() + 5);
    drawn.erase(drawn.begin() + 3);
    for (const int times : drawn) EXPECT_NEAR(times * pixels / (static_cast<double>(kNumbers) * count), 1, 0.04);
  }
}

}  // namespace
}  // namespace isochron
