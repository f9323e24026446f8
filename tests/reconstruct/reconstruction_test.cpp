// What the experiment says that a capture is fitted by.
//
// Statistics: variances of 144 Poisson numbers are compared at five standard deviations (false alarms: 3e-7 each).
#include "optim/reconstruct/reconstruction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/mesh.h"
#include "tests/optim/temporary_folder.h"
#include "tests/reconstruct/simulated.h"
#include "tests/seed.h"

namespace isochron {
namespace {

constexpr double kBinOfPlate = 32 * 0.299792458e-3;

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
  write_capture(folder.file("plate.h5"), capture);
  ReconstructionSpec spec;
  spec.capture = folder.file("plate.h5");
  spec.seconds = 0.5;
  const Reconstruction begun = begin_reconstruction(spec, folder.path(), {});
  EXPECT_TRUE(begun.has_signal);
  return begun.experiment;
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
  write_capture(folder.file("small.h5"), capture);
  ReconstructionSpec spec;
  spec.capture = folder.file("small.h5");
  spec.seconds = 0.5;
  const Reconstruction begun = begin_reconstruction(spec, folder.path(), {});
  ASSERT_TRUE(begun.has_signal);
  const Mesh start = read_mesh(folder.file("start.ply"));
  double area = 0;
  for (const auto& f : start.faces)
    area += 0.5 *
            length(cross(start.positions[f[1]] - start.positions[f[0]], start.positions[f[2]] - start.positions[f[0]]));
  EXPECT_GT(area, side * side);
  for (const ParameterSpec& parameter : load_experiment(folder.file("experiment.yaml")).parameters)
    if (parameter.name == "albedo") {
      EXPECT_LT(parameter.initial.at(0) * area / (side * side), 0.5);
    }
}

}  // namespace
}  // namespace isochron
