// Edits of experiment files: what changes, and that nothing else does.
#include "optim/experiment/experiment_edit.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

TEST(ExperimentEdit, ReplacesValuesAndKeepsComments) {
  const std::string before =
      "# max_bounces: 3 in a comment\n"
      "name: tiny\n"
      "max_bounces: 16            # as many as it takes\n"
      "target: {samples: 64, noise: {photons: 8}, seed: 7}   # independent\n"
      "samples:   # per pixel\n"
      "  primal: 8       # the image\n"
      "\n"
      "  # of the derivative\n"
      "  interior: 4  # few\n"
      "# and\n"
      "seed: 3\n";
  const std::vector<Edit> edits{{{"max_bounces"}, "2"},
                                {{"target", "max_bounces"}, "16"},
                                {{"target", "seed"}, "11"},
                                {{"samples", "primal"}, "123456"},
                                {{"samples", "interior"}, "12345"},
                                {{"samples", "visibility"}, "0"},
                                {{"estimator", "sampling"}, "auto"}};
  EXPECT_EQ(edited(before, edits),
            "# max_bounces: 3 in a comment\n"
            "name: tiny\n"
            "max_bounces: 2             # as many as it takes\n"
            "target: {samples: 64, noise: {photons: 8}, seed: 11, max_bounces: 16}   # independent\n"
            "samples:   # per pixel\n"
            "  primal: 123456  # the image\n"
            "\n"
            "  # of the derivative\n"
            "  interior: 12345 # few\n"
            "  visibility: 0\n"
            "# and\n"
            "seed: 3\n"
            "estimator:\n"
            "  sampling: auto\n");
}

class ExperimentEditFile : public testing::Test {
 protected:
  ExperimentEditFile() { write_tiny_scene(folder_); }
  /// Sets max_bounces to 1 and samples.interior to 5 in a file.
  void edit(const std::string& file) const {
    Experiment wanted = load_experiment(file);
    wanted.estimator.max_bounces = 1;
    wanted.target.max_bounces = 2;
    wanted.samples.interior = 5;
    const std::vector<Edit> edits{
        {{"max_bounces"}, "1"}, {{"target", "max_bounces"}, "2"}, {{"samples", "interior"}, "5"}};
    edit_experiment(file, edits, wanted);
  }
  TemporaryFolder folder_;
};

TEST_F(ExperimentEditFile, ReadsAsWanted) {
  const std::string file = folder_.write("tiny.yaml", fmt::format("{}# the end\n", tiny_experiment()));
  edit(file);
  std::string expected = replaced(tiny_experiment(), "max_bounces: 2", "max_bounces: 1");
  expected = replaced(expected, "seed: 7}", "seed: 7, max_bounces: 2}");
  expected = replaced(expected, "interior: 16", "interior: 5");
  expected += "# the end\n";
  EXPECT_EQ(folder_.read("tiny.yaml"), expected);
  EXPECT_FALSE(folder_.has(".tiny.yaml.edited"));
  edit(file);  // once more changes nothing
  EXPECT_EQ(folder_.read("tiny.yaml"), expected);
}

TEST_F(ExperimentEditFile, LeavesAloneWhatItDoesNotUnderstand) {
  for (const auto& [from, to] : std::vector<std::pair<std::string, std::string>>{
           {"samples: {primal", "samples: {\n  primal"},  // braces over two lines
           {"samples: {primal", "'samples': {primal"},    // a quoted key
           {"max_bounces: 2\n", "max_bounces: &n 2\n"},   // an anchor
           {"interior: 16", "interior:\n 16"},
           {"name: tiny\n", "name: tiny # {\nestimator: {antithetic: true,\n  guiding: false}\n"}}) {
    const std::string text = replaced(tiny_experiment(), from, to);
    const std::string file = folder_.write("tiny.yaml", text);
    Experiment wanted = load_experiment(file);
    wanted.estimator.max_bounces = 1;
    wanted.target.max_bounces = 2;
    wanted.samples.interior = 5;
    wanted.estimator.sampling = Sampling::standard;
    const std::vector<Edit> edits{{{"max_bounces"}, "1"},
                                  {{"target", "max_bounces"}, "2"},
                                  {{"samples", "interior"}, "5"},
                                  {{"estimator", "sampling"}, "standard"}};
    EXPECT_THROW(edit_experiment(file, edits, wanted), InputError) << to;
    EXPECT_EQ(folder_.read("tiny.yaml"), text);
    EXPECT_FALSE(folder_.has(".tiny.yaml.edited"));
  }
}

}  // namespace
}  // namespace isochron
