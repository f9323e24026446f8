#include "optim/run/log.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <sstream>
#include <stdexcept>

#include "core/base/ranks.h"
#include "optim/experiment/files.h"

namespace isochron {
namespace {

constexpr int kMostColumns = 16;

std::string header(const Parameters& parameters) {
  std::string text = "iteration,seconds,loss,image_rmse,param_rmse,gradient_norm";
  const auto columns = [&](const char* norm, const char* suffix) {
    for (const Parameters::Block& block : parameters.blocks()) {
      if (block.count > kMostColumns) {
        text += fmt::format(",{}{}", block.name, norm);
      } else {
        for (int i = block.begin; i < block.begin + block.count; ++i)
          text += fmt::format(",{}{}", parameters.component_names()[i], suffix);
      }
    }
  };
  columns(".norm", "");
  for (const Parameters::Block& block : parameters.blocks()) text += fmt::format(",{}.rmse", block.name);
  columns(".gradient_norm", ".gradient");
  return text + ",loss_noise\n";
}

}  // namespace

Log::Log(const std::string& file, const Parameters& parameters, int next) : name_(file), parameters_(parameters) {
  std::string kept = header(parameters);
  if (const auto old = read_file(file)) {
    std::istringstream lines(*old);
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line) && !lines.eof())
      if (std::atoi(line.c_str()) < next) kept += line + "\n";
  }
  write_file_atomically(file, kept);
  on_first_rank([&] {
    file_.reset(std::fopen(file.c_str(), "a"));
    if (!file_) throw std::runtime_error(file + ": cannot be written");
  });
}

void Log::append(const LogRow& row, const std::vector<double>& theta, const std::vector<double>& gradient) {
  const auto number = [](double value) { return std::isfinite(value) ? exact(value) : std::string(); };
  std::string text = fmt::format("{},{},{},{},{},{}", row.iteration, row.seconds, number(row.loss),
                                 number(row.image_rmse), number(row.param_rmse), number(row.gradient_norm));
  const auto columns = [&](const std::vector<double>& values) {
    for (const Parameters::Block& block : parameters_.blocks()) {
      if (block.count > kMostColumns) {
        double sum = 0;
        for (int i = block.begin; i < block.begin + block.count; ++i) sum += values[i] * values[i];
        text += fmt::format(",{}", number(std::sqrt(sum)));
      } else {
        for (int i = block.begin; i < block.begin + block.count; ++i) text += fmt::format(",{}", number(values[i]));
      }
    }
  };
  columns(theta);
  for (const Parameters::Block& block : parameters_.blocks())
    text += fmt::format(",{}", number(parameters_.distance_to_target(theta, block)));
  columns(gradient);
  text += fmt::format(",{}\n", number(row.loss_noise));
  // The row must be on the disk before the checkpoint that follows it: a resume never writes it again.
  on_first_rank([&] {
    if (std::fwrite(text.data(), 1, text.size(), file_.get()) != text.size() || std::fflush(file_.get()) != 0 ||
        fsync(fileno(file_.get())) != 0)
      throw std::runtime_error(name_ + ": cannot be written");
  });
}

}  // namespace isochron
