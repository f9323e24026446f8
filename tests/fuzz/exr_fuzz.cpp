// EXR files of target images.
#include "core/image/image.h"
#include "tests/fuzz/harness.h"

using namespace isochron;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::Folder folder;
  const std::string file = folder.write("target.exr", data, size);
  fuzz::expect_result_or_input_error([&] {
    const GatedImage image = read_exr(file);
    const std::size_t values =
        static_cast<std::size_t>(image.pixels()) * static_cast<std::size_t>(image.gates * image.channels);
    fuzz::require(values > 0 && image.data.size() == values, "an image has its pixels");
    for (const double value : image.data) fuzz::require(std::isfinite(value), "pixels are finite");
  });
  return 0;
}
