// What the experiment says that a capture is fitted by.
//
// Statistics: variances of 144 Poisson numbers are compared at five standard deviations (false alarms: 3e-7 each).
#include "optim/reconstruct/reconstruction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/mesh.h"
#include "optim/remesh/remesh.h"
#include "tests/optim/temporary_folder.h"
#include "tests/reconstruct/simulated.h"
#include "tests/seed.h"

namespace isochron {
namespace {

constexpr double kBinOfPlate = 32 * 0.299792458e-3;

/// What a reconstruction of a capture begins with, whose files are in `folder`.
Reconstruction begun(const CaptureFile& capture, const TemporaryFolder& folder) {
  ReconstructionSpec spec;
  spec.capture = folder.file("capture.h5");
  spec.seconds = 0.5;
  write_capture(spec.capture, capture);
  const Reconstruction result = begin_reconstruction(spec, folder.path(), {});
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

}  // namespace
}  // namespace isochron
