#pragma once
#include <string>

namespace isochron {

/// Draws the PNGs of an output folder with isochron.plot of app/python. On failure warns in one line and returns false.
bool draw_plots(const std::string& folder);
/// The same with isochron.plot_chart, for what `chart` and `stability` write.
bool draw_charts(const std::string& folder);

}  // namespace isochron
