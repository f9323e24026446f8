#include "optim/run/frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "core/base/ranks.h"

namespace isochron {
namespace {

namespace fs = std::filesystem;

constexpr double kMostBytes = 64e6;

/// Nothing where the file is no frame.
std::optional<int> iteration_of(const fs::path& file) {
  const std::string stem = file.stem().string();
  int iteration = 0;
  const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), iteration);
  if (file.extension() != ".exr" || error != std::errc() || end != stem.data() + stem.size()) return std::nullopt;
  return iteration;
}

}  // namespace

Frames::Frames(const std::string& folder, int most, const GatedImage& image, ExrNotes notes)
    : folder_(folder + "/frames"), most_(most), notes_(std::move(notes)) {
  const double bytes = 4.0 * static_cast<double>(std::max<std::size_t>(image.data.size(), 1));
  if (most > 0) most_ = static_cast<int>(std::clamp(kMostBytes / bytes, 1.0, static_cast<double>(most)));
}

int Frames::stride(int iteration) const {
  int stride = 1;
  while (iteration / stride >= most_) stride *= 2;
  return stride;
}

bool Frames::wants(int iteration) const {
  return most_ > 0 && iteration % stride(iteration) == 0;
}

void Frames::write(int iteration, const GatedImage& image) const {
  on_first_rank([&] { fs::create_directories(folder_); });
  write_exr(fmt::format("{}/{:06}.exr", folder_, iteration), image, notes_);
  on_first_rank([&] { remove_unwanted(iteration); });
}

void Frames::remove_unwanted(int iteration) const {
  std::vector<fs::path> unwanted;
  for (const auto& entry : fs::directory_iterator(folder_))
    if (const auto other = iteration_of(entry.path()); other && (*other % stride(iteration) != 0 || *other > iteration))
      unwanted.push_back(entry.path());
  for (const fs::path& file : unwanted) fs::remove(file);
}

}  // namespace isochron
