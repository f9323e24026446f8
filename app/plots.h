#pragma once
#include <string>

namespace isochron {

/// Draws the PNGs of an output folder with scripts/plot.py. On failure warns in one line and returns false.
bool draw_plots(const std::string& folder);
/// The same with scripts/plot_chart.py, for what `chart` and `stability` write.
bool draw_charts(const std::string& folder);

}  // namespace isochron
