// Mesh files; compiled once per format, which FUZZ_MESH names by its extension.
#include "core/scene/mesh.h"
#include "tests/fuzz/harness.h"

using namespace isochron;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::Folder folder;
  const std::string file = folder.write("mesh." FUZZ_MESH, data, size);
  fuzz::expect_result_or_input_error([&] {
    const Mesh mesh = read_mesh(file);
    fuzz::require(!mesh.faces.empty(), "a mesh has faces");
    for (const Vec3& p : mesh.positions) fuzz::require(fuzz::is_finite(p), "coordinates are finite");
    for (const auto& face : mesh.faces) {
      for (const int v : face)
        fuzz::require(v >= 0 && v < static_cast<int>(mesh.positions.size()), "faces have vertices");
    }
    build_edges(clean_mesh(mesh));
  });
  return 0;
}
