// The command line of the tools that measure: NAME CSV [NUMBER].
#pragma once
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>

namespace isochron::benchmarks {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
/// The table that is written; open.
struct Arguments {
  std::unique_ptr<std::FILE, CloseFile> csv;
  int number;  ///< at least `least`
};
/// Ends the program with a message unless the arguments from argv[first] on are a file and, or not, a number.
inline Arguments read_arguments(int argc, char** argv, int first, const char* usage, int standard, int least) {
  if (argc <= first || argc > first + 2 || argv[first][0] == '-') {
    std::fprintf(stderr, "usage: %s\n", usage);
    std::exit(2);
  }
  Arguments arguments{nullptr, argc > first + 1 ? std::max(least, std::atoi(argv[first + 1])) : standard};
  arguments.csv.reset(std::fopen(argv[first], "w"));
  if (!arguments.csv) {
    std::fprintf(stderr, "%s: cannot write %s\n", argv[0], argv[first]);
    std::exit(1);
  }
  return arguments;
}

}  // namespace isochron::benchmarks
