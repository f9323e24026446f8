// Rewrites the tables of keys in the pages that explain the files, from the descriptions that the readers follow.
//   isochron_reference FOLDER    the folder of the project
#include <fmt/format.h>

#include <exception>
#include <string>

#include "core/base/error.h"
#include "core/scene/scene_loader.h"
#include "optim/experiment/experiment.h"
#include "optim/experiment/files.h"

namespace {

void rewrite(const std::string& file, const std::string& tables) {
  const auto page = isochron::read_file(file);
  if (!page) throw isochron::InputError(file + ": cannot be read");
  const std::string after = isochron::with_tables(*page, tables);
  if (after != *page) isochron::write_file_atomically(file, after);
  fmt::print("{}: {}\n", file, after == *page ? "as it was" : "rewritten");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    if (argc != 2) throw isochron::InputError("usage: isochron_reference FOLDER");
    const std::string root = argv[1];
    rewrite(root + "/experiments/README.md", isochron::experiment_reference());
    rewrite(root + "/scenes/README.md", isochron::scene_reference());
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "isochron_reference: {}\n", error.what());
    return 2;
  }
}
