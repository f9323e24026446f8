// estimator.hidden_shapes: the named shapes take the place of those that parameters change; unknown names are told.
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "optim/problem/problem.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

/// Names of the hidden shapes of the tiny scene, or what is wrong.
std::string hidden_shapes(const std::string& estimator) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string file = folder.write("tiny.yaml", tiny_experiment() + estimator);
  std::string names;
  try {
    const Problem problem(load_experiment(file));
    for (const Shape& shape : problem.scene().shapes)
      if (shape.hidden) names += shape.name + " ";
  } catch (const InputError& error) {
    names = error.what();
    names.erase(0, names.find("tiny.yaml"));
  }
  return names;
}

TEST(HiddenShapes, AreThoseThatParametersChangeOrThatAreNamed) {
  EXPECT_EQ(hidden_shapes(""), "block lamp ");
  EXPECT_EQ(hidden_shapes("estimator: {hidden_shapes: [lamp, floor]}\n"), "floor lamp ");
}

TEST(HiddenShapes, AreNamedWhereThereIsNone) {
  EXPECT_EQ(
      hidden_shapes("estimator: {hidden_shapes: [floor, cube]}\n"),
      "tiny.yaml:12:28: estimator.hidden_shapes: there is no shape 'cube' in the scene (allowed: floor, block, lamp)");
}

}  // namespace
}  // namespace isochron
