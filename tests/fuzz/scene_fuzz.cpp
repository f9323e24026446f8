// Scene files.
#include "core/scene/scene_loader.h"
#include "tests/fuzz/scenes.h"

using namespace isochron;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::Folder folder;
  static const bool prepared = (fuzz::write_meshes(folder), true);
  static_cast<void>(prepared);
  const std::string file = folder.write("scene.yaml", data, size);
  fuzz::expect_result_or_input_error([&] { fuzz::check_scene(load_scene(file)); });
  return 0;
}
