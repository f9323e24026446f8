// NumPy's arrays, as masks and values of parameters are given.
#include "core/image/npy.h"
#include "tests/fuzz/harness.h"

using namespace isochron;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::Folder folder;
  const std::string file = folder.write("array.npy", data, size);
  fuzz::expect_result_or_input_error([&] {
    const NumberArray array = read_npy(file);
    std::size_t count = 1;
    for (const std::size_t extent : array.shape) count *= extent;
    fuzz::require(array.values.size() == count, "an array has its elements");
  });
  return 0;
}
