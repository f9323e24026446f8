#pragma once
#include <stdexcept>
#include <string>

namespace isochron {

/// What the user gave cannot be used: one line that names file, line, column and key. Exit status 2.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace isochron
