// experiments/README.md: its tables are those that the program would write, its examples can be read.
#include <gtest/gtest.h>

#include "optim/experiment/experiment.h"
#include "optim/experiment/files.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

std::string page() {
  return read_file(PROJECT_ROOT "/experiments/README.md").value();
}

std::string between(const std::string& text, const std::string& begin, const std::string& end, std::size_t& at) {
  const std::size_t from = text.find(begin, at);
  if (from == std::string::npos) return {};
  const std::size_t to = text.find(end, from + begin.size());
  at = to + end.size();
  return text.substr(from + begin.size(), to - from - begin.size());
}

std::vector<std::string> examples() {
  std::vector<std::string> all;
  const std::string text = page();
  for (std::size_t at = 0;;) {
    all.push_back(between(text, "```yaml\n", "```\n", at));
    if (all.back().empty()) break;
  }
  all.pop_back();
  return all;
}

TEST(ReferencePage, ExperimentKeysAreThoseOfTheProgram) {
  EXPECT_EQ(with_tables(page(), experiment_reference()), page()) << "scripts/reference rewrites the tables";
}

TEST(ReferencePage, ExamplesCanBeRead) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  ASSERT_GT(examples().size(), 10u);
  for (const std::string& example : examples()) {
    std::string text = example;
    for (const std::string standard : {"name: tiny", "scene: scene.yaml", "gates: {kind: steady}"})
      if (("\n" + example).find("\n" + standard.substr(0, standard.find(" "))) == std::string::npos)
        text += standard + "\n";
    const std::string scene = folder.file("scene.yaml");
    EXPECT_NO_THROW(load_experiment(folder.write("example.yaml", text), {"scene=" + scene})) << text;
  }
}

TEST(ReferencePage, ExamplesHaveEveryKey) {
  std::string all;
  for (const std::string& example : examples()) all += example;
  const std::string tables = experiment_reference();
  int keys = 0;
  for (std::size_t at = 0;; ++keys) {
    const std::string key = between(tables, "\n| `", "`", at);
    if (key.empty()) break;
    if (key == "images" || key == "capture" || key == "mask" || key == "file") continue;  // there is none
    const std::string name = key.substr(key.find_last_of('.') + 1);
    EXPECT_NE(all.find(name + ":"), std::string::npos) << key;
  }
  EXPECT_GT(keys, 50);
}

}  // namespace
}  // namespace isochron
