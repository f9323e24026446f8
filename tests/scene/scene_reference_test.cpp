// scenes/README.md: its tables are those that the program would write, its example can be read.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/scene/scene_loader.h"
#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

std::string page() {
  std::ostringstream text;
  text << std::ifstream(PROJECT_ROOT "/scenes/README.md").rdbuf();
  return text.str();
}

TEST(SceneReference, KeysAreThoseOfTheProgram) {
  EXPECT_EQ(with_tables(page(), scene_reference()), page()) << "scripts/reference rewrites the tables";
}

TEST(SceneReference, ExampleCanBeRead) {
  const std::string text = page(), fence = "```yaml\n";
  const std::size_t begin = text.find(fence) + fence.size();
  TemporaryFolder folder;
  for (const char* beside : {"cube", "bunny"})
    std::filesystem::create_directory_symlink(std::string(PROJECT_ROOT "/scenes/") + beside, folder.path(beside));
  const Scene scene = load_scene(folder.write("scene.yaml", text.substr(begin, text.find("```\n", begin) - begin)));
  EXPECT_EQ(scene.shapes.size(), 3u);
}

}  // namespace
}  // namespace isochron
