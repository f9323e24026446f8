#pragma once
#include <string>
#include <vector>

namespace isochron {

/// Draws the PNGs of an output folder with isochron.plot of app/python. On failure warns in one line and returns false.
bool draw_plots(const std::string& folder);
/// The same with isochron.plot_chart, for what `chart` and `stability` write.
bool draw_charts(const std::string& folder);

/// Both pictures and FOLDER/report.html with isochron.report, for which derivative images are rendered (see final_derivatives.h), at the
/// same time. On failure warns in one line for each and returns false.
bool draw_plots_and_report(const std::string& folder);
/// write_final_derivatives(), with a warning in place of an exception.
void try_final_derivatives(const std::string& folder);
/// Runs isochron.report, reports what it wrote or what is wrong, and returns its exit status.
int run_report(std::vector<std::string> arguments);

}  // namespace isochron
