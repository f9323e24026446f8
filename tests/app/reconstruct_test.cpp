// Captures to surfaces by one command, from counts of a plate that a closed form gives.
#include <cstring>

#include "core/image/capture_file.h"
#include "core/scene/mesh.h"
#include "tests/app/program.h"
#include "tests/reconstruct/simulated.h"

namespace isochron {
namespace {

constexpr double kPs = 0.299792458e-3;

class Reconstruct : public Program {
 protected:
  Reconstruct() { write("plate.h5", 1000); }

  /// A plate of 16 x 16 cm, 0.4 m in front of 10 x 10 points, with so many photons a point.
  void write(const std::string& name, double photons) {
    std::mt19937 random(test_seed(3));
    CaptureFile capture =
        expected_counts(square_wall(10, 0.5), plate({0.02, -0.01, 0.4}, 0.16, 0.16, 0.004), 200, 32 * kPs, photons);
    write_capture(folder_.file(name), counted(capture, 0.3, random));
  }

  std::vector<std::string> command(const std::string& out, std::vector<std::string> more = {},
                                   const std::string& capture = "plate.h5", const std::string& seconds = "2") const {
    std::vector<std::string> arguments{"reconstruct", folder_.file(capture), "-o",        folder_.file(out),
                                       "--quiet",     "--no-plots",          "--seconds", seconds};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  void expect_same(const std::string& a, const std::string& b) const {
    for (const char* file : {"/experiment.yaml", "/scene.yaml", "/start.ply", "/back_projection.ply", "/final.exr",
                             "/final.h5", "/geometry/final_surface.ply"})
      EXPECT_TRUE(folder_.has(b + file) && folder_.read(a + file) == folder_.read(b + file)) << file;
    EXPECT_EQ(log(a), log(b));
  }
};

/// Bins alone would be of another unit than the points.
TEST_F(Reconstruct, PointsOfAFileAreInMetres) {
  folder_.write("plane.obj", "v -0.1 -0.1 0.4\nv 0.1 -0.1 0.4\nv 0.1 0.1 0.4\nf 1 3 2\n");
  folder_.write("wall.yaml",
                "capture: {file: plate.h5}\nmaterials: {paint: {type: diffuse, albedo: 0.5}}\n"
                "shapes: [{name: plane, file: plane.obj, material: paint}]\n");
  const std::string file =
      folder_.write("units.yaml",
                    "name: units\nscene: wall.yaml\nmax_bounces: 1\n"
                    "gates: {kind: bins, unit: ps, scene_unit_m: 0.5}\ntarget: {capture: plate.h5}\n"
                    "loss: {kind: poisson}\n");
  const Result result = run({"render", file, "-o", folder_.file("out")});
  EXPECT_EQ(result.status, 2);
  EXPECT_NE(result.errors.find("units.yaml: gates.scene_unit_m: 0.5, but the points of "), std::string::npos)
      << result.errors;
  EXPECT_FALSE(folder_.has("out"));
}

/// The plate's depth, middle and size; counts are those of 1000 photons at each of 100 points, so that depths are known to a fraction
/// of a millimetre, and what is left is the fit, of few samples here.
TEST_F(Reconstruct, FindsAPlate) {
  const Result result = run(command("out", {}, "plate.h5", "16"));
  ASSERT_EQ(result.status, 0) << result.errors;
  const Mesh mesh = read_mesh(folder_.file("out/geometry/final_surface.ply"));
  double area = 0, depth = 0;
  Vec3 middle;
  for (const auto& face : mesh.faces) {
    const Vec3 &a = mesh.positions[face[0]], &b = mesh.positions[face[1]], &c = mesh.positions[face[2]];
    const double part = -0.5 * cross(b - a, c - a).z;  // faces look at the wall
    area += part;
    middle += (a + b + c) * (part / 3);
    depth += part * std::abs((a.z + b.z + c.z) / 3 - 0.4);
  }
  EXPECT_NEAR(area, 0.16 * 0.16, 0.1 * 0.16 * 0.16);
  EXPECT_LT(depth / area, 0.003);
  EXPECT_NEAR(middle.x / area, 0.02, 0.003);
  EXPECT_NEAR(middle.y / area, -0.01, 0.003);
  const std::string ply = folder_.read("out/geometry/final_surface.ply");
  EXPECT_NE(ply.find("property double albedo\nproperty double standard_error\n"), std::string::npos);
  const std::string summary = folder_.read("out/summary.yaml");
  for (const char* key : {"\nfit: {", "\nat_bounds: {}", "\nstart: {method: back_projection, seconds: ", "\nlevels:\n"})
    EXPECT_NE(summary.find(key), std::string::npos) << key;
  // The evidence weighs the variation of curvature, once the coarse levels are done; slopes of offsets are about motion within a level.
  const auto number = [&](const std::string& level, const std::string& key) {
    const std::string text = folder_.read("out/levels/" + level + "/experiment.yaml");
    const std::size_t at = text.find("\n      " + key + ": ");
    return at == std::string::npos ? std::nan("") : std::stod(text.substr(at + key.size() + 9));
  };
  for (const char* level : {"1", "2", "9"}) EXPECT_EQ(number(level, "variation"), 0) << level;
  EXPECT_GT(number("1", "bending"), 0);
  EXPECT_EQ(number("10", "variation"), number("1", "bending"));
  EXPECT_GT(number("11", "variation"), 0);
  EXPECT_NE(number("11", "variation"), number("10", "variation"));
  for (const char* level : {"2", "10", "11"}) EXPECT_EQ(number(level, "bending"), number("1", "bending")) << level;
  for (const char* level : {"10", "11"}) EXPECT_EQ(number(level, "slopes"), number("1", "slopes")) << level;
  const auto histograms = [&](const char* level) {
    const std::string text = folder_.read(std::string("out/levels/") + level + "/experiment.yaml");
    const std::size_t at = text.find("\n  histograms: ");
    return at == std::string::npos ? 0 : std::stoi(text.substr(at + 15));
  };
  EXPECT_GT(histograms("2"), 0);
  for (const char* level : {"3", "9"}) EXPECT_EQ(2 * histograms(level), histograms("2")) << "by adam";
  EXPECT_EQ(histograms("10"), 0);
  const bool explained = folder_.read("out/levels/11/summary.yaml").find("verdict: explained") != std::string::npos;
  EXPECT_NE(folder_.has("out/levels/12"), explained) << "right fits are rejected by chance 1 %";
  EXPECT_EQ(run({"run", folder_.file("out/experiment.yaml"), "-o", folder_.file("again"), "--quiet", "--no-plots",
                 "--set", "optimizer.iterations=0"})
                .status,
            0)
      << "the folder is no experiment";
}

TEST_F(Reconstruct, TheSameBitsForAnyThreadsAndAfterAKill) {
  const Result first = run(command("one", {"--threads", "1"}));
  ASSERT_EQ(first.status, 0) << first.errors;
  ASSERT_EQ(run(command("two", {"--threads", "2"})).status, 0);
  expect_same("one", "two");
  const std::vector<std::function<bool()>> moments = {[&] { return folder_.has("killed0/levels/1/log.csv"); },
                                                      [&] { return folder_.has("killed1/levels/2/experiment.yaml"); },
                                                      // Of adam, with smoothing of its own.
                                                      [&] { return folder_.has("killed2/levels/5/experiment.yaml"); }};
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const std::string out = "killed" + std::to_string(i);
    EXPECT_EQ(run(command(out), SIGKILL, moments[i]).status, -SIGKILL);
    ASSERT_EQ(run({"resume", folder_.file(out), "--quiet", "--no-plots"}).status, 0);
    expect_same("one", out);
    EXPECT_NE(folder_.read(out + "/summary.yaml").find("\nstart: {"), std::string::npos);
  }
}

/// A response that is half a bin wide and two late is none that any surface explains.
TEST_F(Reconstruct, AnotherLevelFollowsWhereCountsAreNotExplained) {
  folder_.write("late.csv", "offset,value\n0,0\n96,1\n192,1\n288,0\n");
  const std::vector<std::string> late = {"--response", folder_.file("late.csv")};
  ASSERT_EQ(run(command("whole", late)).status, 0);
  EXPECT_NE(folder_.read("whole/levels/11/summary.yaml").find("verdict: unexplained"), std::string::npos);
  EXPECT_TRUE(folder_.has("whole/levels/12/summary.yaml"));
  EXPECT_FALSE(folder_.has("whole/levels/13"));
  EXPECT_EQ(folder_.read("whole/levels/11/summary.yaml").find("standard_errors:"), std::string::npos) << "for nobody";
  EXPECT_NE(folder_.read("whole/levels/12/summary.yaml").find("standard_errors:"), std::string::npos);
  EXPECT_EQ(folder_.read("whole/geometry/final_surface.ply"),
            folder_.read("whole/levels/12/geometry/final_surface.ply"));
  EXPECT_EQ(run(command("killed", late), SIGKILL, [&] { return folder_.has("killed/levels/11/summary.yaml"); }).status,
            -SIGKILL);
  ASSERT_EQ(run({"resume", folder_.file("killed"), "--quiet", "--no-plots"}).status, 0);
  expect_same("whole", "killed");
}

TEST_F(Reconstruct, SaysHowMuchLightIsMissing) {
  write("dark.h5", 0.01);
  const Result result = run(command("out", {}, "dark.h5"));
  EXPECT_EQ(result.status, 1);
  EXPECT_NE(result.errors.find("no light of a hidden surface stands out"), std::string::npos) << result.errors;
  EXPECT_NE(folder_.read("out/summary.yaml").find("fit: {verdict: no_signal, photons_needed: "), std::string::npos);
}

TEST_F(Reconstruct, SaysInOneLineWhatIsWrong) {
  folder_.write("long.csv", "offset,value\n0,1\n100000,1\n");
  CaptureFile point = expected_counts(square_wall(4, 0), plate({0, 0, 0.4}, 0.1, 0.1, 0.1), 200, 32 * kPs, 100);
  write_capture(folder_.file("point.h5"), point);
  folder_.write("words.csv", "offset,value\n0,one\n");
  const std::vector<std::pair<std::vector<std::string>, std::string>> cases = {
      {command("out", {}, "absent.h5"), "absent.h5"},
      {command("out", {"--response", folder_.file("absent.csv")}), "absent.csv: does not exist"},
      {command("out", {"--response", folder_.file("words.csv")}), "words.csv"},
      {command("out", {"--response", folder_.file("long.csv")}), "plate.h5: the capture's 200 bins are too few"},
      {command("out", {}, "point.h5"), "point.h5: the capture's sensor points are all at one place"},
      {command("out", {}, "plate.h5", "0"), "--seconds"},
  };
  for (const auto& [arguments, named] : cases) {
    const Result result = run(arguments);
    EXPECT_EQ(result.status, 2) << named;
    EXPECT_NE(result.errors.find(named), std::string::npos) << result.errors;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
    EXPECT_EQ(result.errors.find("experiment.yaml"), std::string::npos) << "of a folder that nobody knows";
    EXPECT_FALSE(folder_.has("out"));
  }
}

}  // namespace
}  // namespace isochron
