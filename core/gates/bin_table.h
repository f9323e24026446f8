// Readings of contiguous bins, whose ends all lie equally far after a knot of the detector's response: a row of numbers for each
// of the knots that fit into a bin.
#pragma once
#include <algorithm>
#include <vector>

#include "core/gates/linear_density.h"

namespace isochron {

class BinTable {
 public:
  static constexpr int kRun = 8;  ///< bins that are read together, from any of them on
  /// Where the readings of one length are found, from the first bin on that counts light of it:
  ///   W = constant + along linear + half_square square,      dW / dlength = -(linear + along square).
  struct Row {
    const double *constant, *linear, *square;  ///< followed by kRun - 1 zeros
    int size;
    double along, half_square;
  };

  BinTable() = default;
  /// For bins of that width. Empty where no refinement of the response has all its knots on one grid with the bins' ends.
  BinTable(const LinearDensity& response, double width);

  bool empty() const { return rows_.empty(); }
  /// `first_end` in [0, width]: how long after the earliest time at which the light may be counted the first bin ends.
  Row row(double first_end) const {
    const int phase = std::min(static_cast<int>(first_end * steps_per_length_), last_phase_);
    const double along = first_end - phase / steps_per_length_;
    const Place& place = rows_[phase];
    const double* at = &values_[place.begin];
    return {at, at + place.padded, at + 2 * place.padded, place.size, along, 0.5 * along * along};
  }

 private:
  struct Place {
    std::size_t begin;
    int size, padded;
  };

  double steps_per_length_ = 0;
  int last_phase_ = 0;
  std::vector<Place> rows_;
  std::vector<double> values_;
};

}  // namespace isochron
