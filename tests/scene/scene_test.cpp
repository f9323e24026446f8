#include "core/scene/scene.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/seed.h"

namespace isochron {
namespace {

TEST(TangentBasis, TransposeProductMatchesTheDenseMatrix) {
  constexpr int kRows = 40, kColumns = 7;
  std::mt19937 random(test_seed(3));
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<std::vector<double>> dense(kRows, std::vector<double>(kColumns, 0.0));
  TangentBasis basis;
  basis.columns = kColumns;
  basis.row_begin.push_back(0);
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      if (uniform(random) < 0.4) continue;
      dense[row][column] = uniform(random);
      basis.entries.push_back({column, dense[row][column]});
    }
    basis.row_begin.push_back(static_cast<int>(basis.entries.size()));
  }
  std::vector<double> gradient(kRows);
  for (double& g : gradient) g = uniform(random);
  const std::vector<double> product = basis.transpose_apply(gradient);
  ASSERT_EQ(product.size(), static_cast<std::size_t>(kColumns));
  for (int column = 0; column < kColumns; ++column) {
    long double expected = 0;
    for (int row = 0; row < kRows; ++row) expected += static_cast<long double>(dense[row][column]) * gradient[row];
    EXPECT_NEAR(product[column], static_cast<double>(expected), 1e-14);
  }
}

}  // namespace
}  // namespace isochron
