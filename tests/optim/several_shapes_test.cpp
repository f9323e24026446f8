// Parameters that change several shapes alike.
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

/// `lines` in place of the tiny experiment's parameters.
std::string with_parameters(const std::string& lines) {
  const std::string text = tiny_experiment();
  const std::size_t begin = text.find("  - {name: height"), end = text.find("target: {samples");
  return text.substr(0, begin) + lines + text.substr(end);
}

const char* const kTogether =
    "  - {name: move, type: translation, shape: [block, lamp], direction: [1, 0.5, 0], initial: 0.1, target: 0}\n"
    "  - {name: slide, type: translation, shape: lamp, direction: [0, 0, 1], initial: 0.2, target: 0}\n"
    "  - {name: turn, type: rotation, shape: [block, lamp], axis: [0, 2, 1], pivot: center, initial: 20, target: 0}\n"
    "  - {name: hinge, type: rotation, shape: [lamp, block], axis: [1, 0, 0], pivot: {follow: [0, 0.5, 0.5]}, "
    "initial: 10, target: 0}\n"
    "  - {name: power, type: emission, shape: [lamp, block], initial: 8, target: 10}\n";

class SeveralShapes : public testing::Test {
 protected:
  SeveralShapes() { write_tiny_scene(folder_); }
  std::string write(const std::string& parameters) const {
    return folder_.write("tiny.yaml", with_parameters(parameters));
  }
  std::string error_of(const std::string& parameters) const {
    try {
      const Problem problem(load_experiment(write(parameters)));
    } catch (const InputError& error) {
      const std::string what = error.what();
      return what.substr(what.find(".yaml:") + 6);
    }
    return "accepted";
  }
  const TemporaryFolder folder_;
};

/// Coordinates, and emissions behind them, as DofLayout has them.
std::vector<double> changed(const Scene& scene) {
  std::vector<double> all(static_cast<std::size_t>(DofLayout(scene).size()), 0.0);
  const DofLayout layout(scene);
  for (std::size_t v = 0; v < scene.positions.size(); ++v)
    for (int axis = 0; axis < 3; ++axis) all[layout.vertex(static_cast<int>(v), axis)] = scene.positions[v][axis];
  for (std::size_t s = 0; s < scene.shapes.size(); ++s)
    for (int c = 0; c < 3; ++c) all[layout.emission(static_cast<int>(s), c)] = scene.shapes[s].emission.radiance[c];
  return all;
}

TEST_F(SeveralShapes, TangentIsTheDerivativeOfAllOfThem) {
  const Problem problem(load_experiment(write(kTogether)));
  const Parameters& parameters = problem.parameters();
  ASSERT_EQ(parameters.size(), 5);
  const std::vector<double> theta = parameters.initial();
  const TangentBasis basis = parameters.tangent(theta);
  for (int column = 0; column < basis.columns; ++column) {
    constexpr double kStep = 1e-5;
    std::vector<double> up = theta, down = theta;
    up[column] += kStep, down[column] -= kStep;
    const std::vector<double> above = changed(parameters.apply(up)), below = changed(parameters.apply(down));
    int moving = 0;
    for (std::size_t row = 0; row < above.size(); ++row) {
      double coefficient = 0;
      for (int e = basis.row_begin[row]; e < basis.row_begin[row + 1]; ++e)
        if (basis.entries[e].column == column) coefficient = basis.entries[e].coefficient;
      EXPECT_NEAR(coefficient, (above[row] - below[row]) / (2 * kStep), 1e-8) << row << " by " << column;
      moving += coefficient != 0;
    }
    EXPECT_GT(moving, column == 1 ? 3 : 5) << column;  // of both shapes, but for `slide`
  }
}

/// The shapes turn as one body, about the mean of all their vertices, which the common translation carries.
TEST_F(SeveralShapes, TurnAboutOneCentre) {
  const Problem problem(load_experiment(write(
      "  - {name: move, type: translation, shape: [block, lamp], direction: [1, 0, 0], initial: 0, target: 0}\n"
      "  - {name: slide, type: translation, shape: lamp, direction: [0, 0, 1], initial: 0, target: 0}\n"
      "  - {name: turn, type: rotation, shape: [block, lamp], axis: [0, 0, 1], pivot: center, initial: 0, target: "
      "0}\n")));
  const Scene& loaded = problem.scene();
  const Scene moved = problem.parameters().apply({2, 0.5, 90});
  const int first = loaded.shapes[loaded.find_shape("block")].first_vertex;
  Vec3 centre;
  for (std::size_t v = static_cast<std::size_t>(first); v < loaded.positions.size(); ++v)
    centre += loaded.positions[v] / static_cast<double>(loaded.positions.size() - first);
  for (std::size_t v = static_cast<std::size_t>(first); v < loaded.positions.size(); ++v) {
    const Vec3 from = loaded.positions[v] - centre;
    const bool of_lamp = static_cast<int>(v) >= loaded.shapes[loaded.find_shape("lamp")].first_vertex;
    const Vec3 expected = centre + Vec3{2 - from.y, from.x, from.z + (of_lamp ? 0.5 : 0)};
    EXPECT_NEAR(length(moved.positions[v] - expected), 0, 1e-13) << v;
  }
}

TEST_F(SeveralShapes, GradientIsTheSumOfThoseOfEach) {
  const Problem together(load_experiment(write(
      "  - {name: move, type: translation, shape: [block, lamp], direction: [0, 1, 0], initial: 0.1, target: 0}\n")));
  const Problem each(load_experiment(
      write("  - {name: one, type: translation, shape: block, direction: [0, 1, 0], initial: 0.1, target: 0}\n"
            "  - {name: other, type: translation, shape: lamp, direction: [0, 1, 0], initial: 0.1, target: 0}\n")));
  GatedImage adjoint = together.blank();
  std::fill(adjoint.data.begin(), adjoint.data.end(), 1.0);
  const std::vector<double> sum = together.transpose_apply({0.1}, adjoint, 0);
  const std::vector<double> parts = each.transpose_apply({0.1, 0.1}, adjoint, 0);
  EXPECT_NE(parts[0], 0);
  EXPECT_NE(parts[1], 0);
  EXPECT_NEAR(sum[0], parts[0] + parts[1], 1e-9 * (std::abs(parts[0]) + std::abs(parts[1])));
}

TEST_F(SeveralShapes, AreWrittenAndReadBack) {
  const Experiment original = load_experiment(write(kTogether));
  const std::string resolved = resolved_yaml(original, folder_.path());
  const Experiment back = load_experiment(folder_.write("resolved.yaml", resolved));
  EXPECT_EQ(back.parameters[0].shapes(), (std::vector<std::string>{"block", "lamp"}));
  EXPECT_EQ(back.parameters[1].shapes(), (std::vector<std::string>{"lamp"}));
  EXPECT_EQ(resolved_yaml(back, folder_.path()), resolved);
}

TEST_F(SeveralShapes, ErrorsNameTheShape) {
  const std::string rest = ", direction: [0, 1, 0], initial: 0, target: 0}\n";
  EXPECT_EQ(error_of("  - {name: a, type: translation, shape: [block, blok]" + rest),
            "6:41: parameters[0].shape: there is no shape 'blok' in the scene (allowed: floor, block, lamp)");
  EXPECT_EQ(error_of("  - {name: a, type: translation, shape: [block, block]" + rest),
            "6:41: parameters[0].shape: 'block' is listed twice");
  EXPECT_EQ(error_of("  - {name: a, type: translation, shape: []" + rest),
            "6:41: parameters[0].shape: holds no name (at least one)");
  EXPECT_EQ(error_of("  - {name: a, type: vertices, shape: [block, lamp]" + rest),
            "6:38: parameters[0].shape: a parameter of type vertices changes one shape (a name; lists for translation, "
            "rotation and emission)");
  EXPECT_EQ(error_of("  - {name: a, type: translation, shape: [block, lamp], selection: [0]" + rest),
            "6:67: parameters[0].selection: counts the vertices of one shape, and there are several (a box)");
  EXPECT_EQ(error_of("  - {name: a, type: emission, shape: [lamp, block], initial: 1, target: 1}\n"
                     "  - {name: b, type: emission, shape: block, initial: 1, target: 1}\n"),
            "7:21: parameters[1].type: another parameter sets the same emission already");
}

}  // namespace
}  // namespace isochron
