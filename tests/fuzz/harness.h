// What the fuzzing harnesses share. Whatever the bytes, a loader returns something usable or throws
// InputError with one line; all else (other exceptions, reports of the sanitizers, hangs, gigabytes) is a
// finding.
#pragma once
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "core/base/error.h"
#include "core/base/vec.h"

namespace isochron::fuzz {

/// The input's folder. `scripts/test --fuzz` sets TMPDIR to one in memory and removes it.
class Folder {
 public:
  Folder() : path_((std::filesystem::temp_directory_path() / "isochron_fuzz_XXXXXX").string()) {
    if (::mkdtemp(path_.data()) == nullptr) throw std::runtime_error("no temporary folder");
  }
  std::string write(const std::string& name, const void* data, std::size_t size) const {
    const std::string file = path_ + "/" + name;
    std::ofstream stream(file, std::ios::binary);
    stream.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
    return file;
  }
  std::string write(const std::string& name, const std::string& text) const {
    return write(name, text.data(), text.size());
  }

 private:
  std::string path_;
};

/// Stops, so that libFuzzer keeps the input.
inline void require(bool holds, const std::string& what) {
  if (holds) return;
  std::fprintf(stderr, "fuzz: violated: %s\n", what.c_str());
  std::abort();
}

inline bool is_finite(const Vec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Runs a loader and what the harness checks about its result. An exception of another type ends the program.
template <class Action>
void expect_result_or_input_error(Action&& action) {
  try {
    action();
  } catch (const InputError& error) {
    const std::string line = error.what();
    const bool printable =
        std::none_of(line.begin(), line.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; });
    require(!line.empty() && printable, "an error of one line: " + line);
  }
}

}  // namespace isochron::fuzz
