// What the experiment says that a capture is fitted by.
//
// Statistics: variances of 144 Poisson numbers are compared at five standard deviations (false alarms: 3e-7 each).
#include "optim/reconstruct/reconstruction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/image/npy.h"
#include "core/scene/mesh.h"
#include "optim/remesh/remesh.h"
#include "tests/optim/temporary_folder.h"
#include "tests/reconstruct/simulated.h"
#include "tests/seed.h"

namespace isochron {
namespace {

constexpr double kBinOfPlate = 32 * 0.299792458e-3;

/// What a reconstruction of a capture begins with, whose files are in `folder`.
Reconstruction begun(const CaptureFile& capture, const TemporaryFolder& folder, const std::string& name = "capture.h5",
                     const std::function<void(const std::string&)>& warning = {}) {
  ReconstructionSpec spec;
  spec.capture = folder.file(name);
  spec.seconds = 0.5;
  write_capture(spec.capture, capture);
  const Reconstruction result = begin_reconstruction(spec, folder.path(), warning);
  EXPECT_TRUE(result.has_signal);
  return result;
}

/// A plate before 12 x 12 points whose backgrounds differ by so many parts of themselves, at random.
std::string experiment_of(double spread) {
  const TemporaryFolder folder;
  std::mt19937 random(test_seed(7));
  CaptureFile capture =
      expected_counts(square_wall(12, 0.5), plate({0.02, -0.01, 0.4}, 0.16, 0.16, 0.004), 256, kBinOfPlate, 2000);
  // A tail, such as responses have: what lies behind the plate's light is darker than that, but no background.
  for (int p = 0; p < capture.counts.pixels(); ++p) {
    double tail = 0;
    for (int g = 0; g < capture.counts.gates; ++g) {
      tail = 0.9 * tail + 0.02 * capture.counts.at(p, g);
      capture.counts.at(p, g) += tail;
    }
  }
  for (int p = 0; p < capture.counts.pixels(); ++p) {
    const double background = 2 * (1 + spread * std::normal_distribution<double>()(random));
    for (int g = 0; g < capture.counts.gates; ++g)
      capture.counts.at(p, g) =
          std::poisson_distribution<int>(capture.counts.at(p, g) + std::max(0.1, background))(random);
  }
  return begun(capture, folder).experiment;
}

TEST(Reconstruction, BackgroundsOfEachPointWhereTheyDiffer) {
  EXPECT_EQ(experiment_of(0).find("type: background, per: pixel"), std::string::npos)
      << "light's tails differ, not they";
  EXPECT_NE(experiment_of(0.3).find("type: background, per: pixel"), std::string::npos);
}

/// A start is larger than what is hidden. Where the fit has shrunk it, parts may be twice as bright as the rest below their bound of 1.
TEST(Reconstruction, AlbedosHaveRoomForASurfaceThatShrinks) {
  const TemporaryFolder folder;
  CaptureGeometry wall = square_wall(16, 0.5);
  add_spots(wall, {{0.05, 0.05, 0}});
  const double side = 0.12;
  CaptureFile capture = expected_counts(wall, plate({0.02, -0.01, 0.4}, side, side, 0.004), 256, kBinOfPlate, 2000);
  for (double& value : capture.counts.data) value += 0.5;
  begun(capture, folder);
  const double area = surface_area(read_mesh(folder.file("start.ply")));
  EXPECT_GT(area, side * side);
  for (const ParameterSpec& parameter : load_experiment(folder.file("experiment.yaml")).parameters)
    if (parameter.name == "albedo") {
      EXPECT_LT(parameter.initial.at(0) * area / (side * side), 0.5);
    }
}

/// Counts of a plate before 12 x 12 points.
CaptureFile plate_counts() {
  CaptureFile capture =
      expected_counts(square_wall(12, 0.5), plate({0.02, -0.01, 0.4}, 0.16, 0.16, 0.004), 256, kBinOfPlate, 2000);
  for (double& value : capture.counts.data) value += 0.5;
  return capture;
}

TEST(Reconstruction, LeavesOutDeadPoints) {
  const TemporaryFolder folder;
  CaptureFile capture = plate_counts();
  capture.counts.at(17, 3) = std::nan("");
  capture.counts.at(40, 250) = -1;
  for (int g = 0; g < capture.counts.gates; ++g) capture.counts.at(77, g) = 0;
  std::vector<std::string> warnings;
  const auto note = [&](const std::string& text) { warnings.push_back(text); };
  const std::string text = begun(capture, folder, "capture.h5", note).experiment;
  EXPECT_NE(text.find("\n  mask: mask.npy\n"), std::string::npos) << text;
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[0].find("capture.h5: 3 of 144 points are left out"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("capture.h5: has values that are no whole numbers"), std::string::npos) << warnings[1];
  const NumberArray mask = read_npy(folder.file("mask.npy"));
  EXPECT_EQ(mask.shape, (std::vector<std::size_t>{12, 12}));
  for (int p = 0; p < 144; ++p) EXPECT_EQ(mask.values[p % 12 * 12 + p / 12], p != 17 && p != 40 && p != 77) << p;
  const TemporaryFolder whole;
  EXPECT_EQ(begun(plate_counts(), whole).experiment.find("mask"), std::string::npos);
}

/// Where dark counts were taken off, all points have values below zero. That is said before anything is made of them.
TEST(Reconstruction, RefusesWhatIsNoCount) {
  const TemporaryFolder folder;
  CaptureFile capture = plate_counts();
  for (double& value : capture.counts.data) value -= 0.6;
  try {
    begun(capture, folder);
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("capture.h5: 144 of 144 points have values below zero"), std::string::npos)
        << error.what();
  }
}

/// Images of 16 samples: their noise is above that of 80 photons. Priors of ten times as many weigh ten times as much.
TEST(Reconstruction, PhotonsBeyondWhatSamplesTellDoNotWeighMore) {
  const auto bending_of = [](double factor) {
    const TemporaryFolder folder;
    CaptureFile capture = plate_counts();
    for (double& value : capture.counts.data) value *= factor;
    begun(capture, folder);
    const Experiment experiment = load_experiment(folder.file("experiment.yaml"));
    EXPECT_EQ(experiment.samples.primal, 16);
    EXPECT_EQ(experiment.parameters[0].variation, experiment.parameters[0].bending);
    return experiment.parameters[0].bending;
  };
  const double many = bending_of(1);
  EXPECT_EQ(bending_of(0.02), 1);
  EXPECT_NEAR(many, 2000 / 80.0, 10);
  EXPECT_NEAR(bending_of(10) / many, 10, 0.1);
}

/// Names of experiments have no blanks, dots or letters beyond ASCII.
TEST(Reconstruction, TakesFilesOfAnyName) {
  for (const char* name : {"scan 3.2 # a: \"b\".h5",
                           "gr\xc3\xb6\xc3\x9f"
                           "e.h5",
                           "-x.h5"}) {
    const TemporaryFolder folder;
    begun(plate_counts(), folder, name);
    EXPECT_EQ(load_experiment(folder.file("experiment.yaml")).target.capture, folder.file(name)) << name;
  }
}

TEST(Reconstruction, NeedsSecondsThatAreANumber) {
  const TemporaryFolder folder;
  ReconstructionSpec spec;
  spec.capture = folder.file("capture.h5");
  write_capture(spec.capture, plate_counts());
  for (const double seconds : {std::nan(""), 0.0, -1.0, 1e7}) {
    spec.seconds = seconds;
    EXPECT_THROW(begin_reconstruction(spec, folder.path(), {}), InputError) << seconds;
  }
}

}  // namespace
}  // namespace isochron
