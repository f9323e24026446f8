#include "core/gates/bin_table.h"

#include <cmath>
#include <optional>

namespace isochron {
namespace {

/// Tables of so many rows, three numbers each, still lie in the second-level cache (1.5 MB).
constexpr double kMostRows = 1 << 16;

struct Refinement {
  int parts;   ///< of an interval of the response
  int stride;  ///< parts in a bin
};

std::optional<Refinement> refinement(const LinearDensity& response, double width) {
  if (!response.even()) return std::nullopt;
  const double intervals = static_cast<double>(response.knots().size()) - 1;
  const double steps = width / (response.upper() - response.lower()) * intervals;
  for (int parts = 1; parts * (intervals + BinTable::kRun * steps) <= kMostRows; ++parts) {
    const double stride = std::round(parts * steps);
    if (stride >= 1 && std::abs(parts * steps - stride) <= LinearDensity::kEven)
      return Refinement{parts, static_cast<int>(stride)};
  }
  return std::nullopt;
}

/// The refined response where its intervals begin: integral up to there, value and slope.
struct Refined {
  Refined(const LinearDensity& response, int parts) {
    const auto& knots = response.knots();
    for (std::size_t i = 0; i + 1 < knots.size(); ++i)
      for (int k = 0; k < parts; ++k) {
        const double along = k * (knots[i + 1].offset - knots[i].offset) / parts;
        const double value = knots[i].value + knots[i].slope * along;
        below.push_back(knots[i].below + 0.5 * along * (knots[i].value + value));
        values.push_back(value);
        slopes.push_back(knots[i].slope);
      }
  }
  int size() const { return static_cast<int>(below.size()); }

  std::vector<double> below, values, slopes;
};

}  // namespace

BinTable::BinTable(const LinearDensity& response, double width) {
  const auto grid = refinement(response, width);
  if (!grid) return;
  const Refined refined(response, grid->parts);
  steps_per_length_ = grid->stride / width;
  last_phase_ = grid->stride - 1;
  for (int phase = 0; phase < grid->stride; ++phase) {
    const int ends = phase < refined.size() ? (refined.size() - 1 - phase) / grid->stride + 1 : 0;
    const int size = ends + 1, padded = size + kRun - 1;
    rows_.push_back({values_.size(), size, padded});
    values_.resize(values_.size() + 3 * static_cast<std::size_t>(padded));
    double* row = &values_[rows_.back().begin];
    for (int i = 0; i < size; ++i) {
      // A bin's end where the response is not over; after the last of them all light has been counted.
      const int end = phase + i * grid->stride, begin = end - grid->stride;
      const bool has_begin = i > 0;
      const bool has_end = i < ends;
      const auto difference = [&](const std::vector<double>& of, double after) {
        return ((has_end ? of[end] : after) - (has_begin ? of[begin] : 0)) / width;
      };
      row[i] = difference(refined.below, 1);
      row[padded + i] = difference(refined.values, 0);
      row[2 * padded + i] = difference(refined.slopes, 0);
    }
  }
}

}  // namespace isochron
