#include "optim/experiment/number_file.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "tests/optim/temporary_folder.h"

namespace isochron {
namespace {

using Rows = std::vector<std::vector<double>>;

class NumberFile : public ::testing::Test {
 protected:
  Rows read(const std::string& contents, const std::vector<std::string>& columns = {}) {
    folder_.write("numbers.csv", contents);
    return read_number_file(folder_.file("numbers.csv"), columns);
  }
  std::string error(const std::string& contents, const std::vector<std::string>& columns = {}) {
    try {
      read(contents, columns);
    } catch (const InputError& error) {
      const std::string message = error.what(), file = folder_.file("numbers.csv");
      return message.starts_with(file) ? message.substr(file.size()) : message;
    }
    return "no error";
  }
  TemporaryFolder folder_;
};

TEST_F(NumberFile, RowsAreThoseOfTheLinesHoweverTheyEnd) {
  const Rows expected{{-1, 0.5}, {2e3, 1e-3}, {0, 7}};
  for (const std::string mark : {"", "\xEF\xBB\xBF"})
    for (const std::string end : {"\n", "\r", "\r\n"}) {
      const std::string rows = "-1 ,\t.5 # first" + end + end + "2e3,1E-3" + end + "1e-999 +7";
      EXPECT_EQ(read(mark + rows), expected);
      EXPECT_EQ(read(mark + "offset,value" + end + rows, {"offset", "value"}), expected);
      EXPECT_EQ(error(mark + rows + end + " 1 x" + end), ":5:4: 'x' is not a finite number");
    }
}

TEST_F(NumberFile, WhatIsNoNumberIsRefusedWithItsPlace) {
  for (const char* word : {"nan", "-inf", "1e999", "0x1p3", "1;2", "1.5e", "--1", "+-1", "1_000"})
    EXPECT_EQ(error(std::string("0 0\n3 ") + word), std::string(":2:3: '") + word + "' is not a finite number");
  EXPECT_EQ(error("offset,other\n0,1\n", {"offset", "value"}), ":1:1: 'offset' is not a finite number");
  EXPECT_EQ(error("1,2\n1,2,3\n", {"offset", "value"}), ":2:1: 3 numbers in this row (allowed: 2)");
  EXPECT_EQ(error(std::string("\xFE\xFF\0001", 4)), ": is text in UTF-16 (allowed: UTF-8)");
}

/// Version 1.0 of NumPy's format: a header padded to 64 bytes, then the values.
std::string array_file(const std::string& shape, const std::vector<double>& values) {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (" + shape + "), }";
  header.resize(128 - 10 - 1, ' ');
  std::string contents("\x93NUMPY\x01\x00\x76\x00", 10);
  contents += header + "\n";
  return contents.append(reinterpret_cast<const char*>(values.data()), sizeof(double) * values.size());
}

TEST_F(NumberFile, ArraysKeepTheirBits) {
  const double third = 1.0 / 3, tiny = 5e-324;
  const auto read_array = [&](const std::string& shape, const std::vector<double>& values,
                              const std::vector<std::string>& columns = {}) {
    folder_.write("a.npy", array_file(shape, values));
    return read_number_file(folder_.file("a.npy"), columns);
  };
  EXPECT_EQ(read_array("2, 2", {1, third, 2, tiny}, {"offset", "value"}), (Rows{{1, third}, {2, tiny}}));
  EXPECT_EQ(read_array("1, 3", {1, third, tiny}), (Rows{{1, third, tiny}}));
  EXPECT_EQ(read_array("3,", {1, third, tiny}), (Rows{{1, third, tiny}}));
  const auto error = [&](const std::string& shape, const std::vector<double>& values,
                         const std::vector<std::string>& columns = {}) -> std::string {
    try {
      read_array(shape, values, columns);
    } catch (const InputError& problem) {
      return std::string(problem.what()).substr(folder_.file("a.npy").size());
    }
    return "no error";
  };
  EXPECT_EQ(error("1, 3", {1, 2, 3}, {"offset", "value"}), ": an array of [1, 3] (allowed: [rows, 2])");
  EXPECT_EQ(error("2,", {1, 2}, {"offset", "value"}), ": an array of [2] (allowed: [rows, 2])");
  EXPECT_EQ(error("2,", {1, std::nan("")}), ": value 1 is not a finite number");
  EXPECT_EQ(error("2, 2", {1, 2, 3}), ": ends before its 2 x 2 elements");
}

}  // namespace
}  // namespace isochron
