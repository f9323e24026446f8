#include "optim/run/level_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "optim/experiment/files.h"

namespace isochron {
namespace {

std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> result;
  std::istringstream text(line + ",");
  for (std::string cell; std::getline(text, cell, ',');) result.push_back(cell);
  return result;
}

std::vector<std::vector<std::string>> rows(const std::string& log) {
  std::vector<std::vector<std::string>> result;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) result.push_back(cells(line));
  return result;
}

}  // namespace

std::string joined_logs(const std::vector<std::string>& logs) {
  if (logs.empty()) return "";
  const std::vector<std::string> names = rows(logs.back())[0];
  std::string text = fmt::format("{},level\n", fmt::join(names, ","));
  long long iterations = 0;
  double seconds = 0;
  for (std::size_t level = 0; level < logs.size(); ++level) {
    const auto table = rows(logs[level]);
    std::vector<std::string> row(names.size());
    for (std::size_t i = 1; i < table.size(); ++i) {
      for (std::size_t k = 0; k < names.size(); ++k) {
        const auto found = std::find(table[0].begin(), table[0].end(), names[k]);
        row[k] = found == table[0].end() ? "" : table[i][static_cast<std::size_t>(found - table[0].begin())];
      }
      row[0] = std::to_string(iterations + std::atoll(row[0].c_str()));
      row[1] = exact(seconds + std::atof(row[1].c_str()));
      text += fmt::format("{},{}\n", fmt::join(row, ","), level + 1);
    }
    if (table.size() < 2) continue;
    iterations = std::atoll(row[0].c_str()) + 1;
    seconds = std::atof(row[1].c_str());
  }
  return text;
}

}  // namespace isochron
