#pragma once
#include <CLI/CLI.hpp>

namespace isochron {

/// --man-pages DIR, which --help does not show: the build writes the manual by it. To be called after all commands are
/// declared: the pages are made from what --help is made from.
void add_man_pages_option(CLI::App& app);

}  // namespace isochron
