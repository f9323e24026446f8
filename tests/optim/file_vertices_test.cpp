// Parameters of shapes whose mesh files have vertices without a face, or several at one position.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/scene/scene_loader.h"
#include "optim/problem/parameters.h"
#include "optim/problem/problem.h"
#include "tests/optim/temporary_folder.h"

namespace isochron {
namespace {

// In the file 0 and 5 have no face, and 3 lies on 1. In the scene: (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0).
constexpr const char* kMesh = "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 0 0\nv 1 1 0\nv 0.5 0.5 0\nv 0 1 0\nf 2 3 5\nf 4 5 7\n";
constexpr const char* kScene =
    "camera: {position: [0.5, 0.5, 3], look_at: [0.5, 0.5, 0], up: [0, 1, 0], fov: 60, resolution: [2, 2]}\n"
    "materials: {w: {type: diffuse, albedo: 0.5}}\n"
    "shapes: [{name: m, file: m.obj, material: w}]\n"
    "lights: [{name: l, type: point, position: [0.5, 0.5, 3], intensity: 10}]\n";

class FileVerticesTest : public ::testing::Test {
 protected:
  FileVerticesTest() {
    folder_.write("m.obj", kMesh);
    folder_.write("scene.yaml", kScene);
  }
  Problem problem(const std::string& parameter) {
    folder_.write("values.txt", "9 0.1 0.2 0.1 0.3 9 0.4\n");
    folder_.write("seams.txt", "9 0.1 0.2 0.5 0.3 9 0.4\n");
    const char* const target = parameter.find("target") == std::string::npos ? ", target: 0.5" : "";
    folder_.write("e.yaml",
                  "name: t\nscene: scene.yaml\nmax_bounces: 1\ngates: {kind: steady}\nparameters:\n  - {name: p, " +
                      parameter + target + "}\n");
    return Problem(load_experiment(folder_.file("e.yaml")));
  }
  Scene moved(const std::string& parameter) {
    const Problem p = problem(parameter);
    return p.parameters().apply(p.parameters().initial());
  }
  std::string error(const std::string& parameter) {
    try {
      problem(parameter);
    } catch (const InputError& error) {
      const std::string message = error.what();
      return message.substr(message.find("parameters[0]."));
    }
    return "no error";
  }
  TemporaryFolder folder_;
};

TEST_F(FileVerticesTest, SelectionsCountAsTheFileDoes) {
  // Number 3 is the corner at the origin, as 1 is.
  for (const char* selection : {"[1]", "[3]", "[3, 1]"}) {
    const Scene scene = moved(std::string("type: vertices, shape: m, selection: ") + selection +
                              ", direction: [0, 0, 1], initial: 0.25");
    EXPECT_EQ(scene.positions, (std::vector<Vec3>{{0, 0, 0.25}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}})) << selection;
  }
  const Scene scene = moved("type: vertices, shape: m, selection: [6, 2], direction: [0, 0, 1], initial: [0.5, 0.25]");
  EXPECT_EQ(scene.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0.25}, {1, 1, 0}, {0, 1, 0.5}}));
  const std::string head = "type: vertices, shape: m, direction: [0, 0, 1], initial: 0, selection: ";
  EXPECT_EQ(error(head + "[2, 5]"), "parameters[0].selection: vertex 5 of shape 'm' has no face");
  EXPECT_EQ(error(head + "[7]"), "parameters[0].selection: there is no vertex 7 in shape 'm' (0 to 6)");
  EXPECT_EQ(error(head + "[3, 3]"), "parameters[0].selection: vertex 3 is listed twice");
}

TEST_F(FileVerticesTest, ValuesStandForTheVerticesOfTheFile) {
  const std::vector<double> each{0.1, 0.2, 0.3, 0.4};
  const std::string paint = "type: albedo, shape: m, per: vertex, initial: ";
  EXPECT_EQ(moved(paint + "values.txt").texture, each);
  EXPECT_EQ(moved(paint + "[0.1, 0.2, 0.3, 0.4]").texture, each);  // of those with a face
  EXPECT_EQ(error(paint + "[0.1, 0.2, 0.3, 0.4, 0.5]"), "parameters[0].initial: 5 values are given (1, 4 or 7)");
  EXPECT_EQ(error(paint + "seams.txt"),
            "parameters[0].initial: two vertices at one position have the values 0.1 and 0.5 (one value)");
  const Scene scene = moved("type: vertices, shape: m, direction: [0, 0, 1], initial: values.txt");
  for (int v = 0; v < 4; ++v) EXPECT_EQ(scene.positions[v].z, each[v]);
  const Scene free = moved(
      "type: vertices, shape: m, direction: free, selection: [2, 3, 1], initial: "
      "[0, 0, 1, 0, 2, 0, 0, 2, 0]");
  EXPECT_EQ(free.positions[1], (Vec3{1, 0, 1}));
  EXPECT_EQ(free.positions[0], (Vec3{0, 2, 0}));
}

TEST_F(FileVerticesTest, OneUnknownForEachVertexThatIsSeen) {
  // None moves in vain: the mean square distance and the errors are those of vertices that are there.
  const Problem p = problem("type: vertices, shape: m, direction: normal, initial: 0, target: 1");
  EXPECT_EQ(p.parameters().size(), 4);
  const TangentBasis basis = p.parameters().tangent(p.parameters().initial());
  std::vector<int> rows(4);
  for (const auto& entry : basis.entries) ++rows[entry.column];
  EXPECT_EQ(rows, (std::vector<int>{1, 1, 1, 1}));
  EXPECT_EQ(p.parameters().distance_to_target(p.parameters().initial()), 1);
}

}  // namespace
}  // namespace isochron
