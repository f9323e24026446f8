// Seeds of the tests' own generators (std::mt19937). Tests have fixed seeds, so that they pass or fail the same way everywhere;
// ISOCHRON_TEST_SEED=N in the environment shifts all of them, as it does with the renderer's numbers (core/base/random.h). So
// `scripts/test --seeds` finds out how often a test fails by chance.
#pragma once
#include "core/base/random.h"

namespace isochron {

/// `seed` as it stands, or shifted by ISOCHRON_TEST_SEED.
inline std::uint32_t test_seed(std::uint32_t seed) {
  return seed + 1000003u * kTestSeed;
}

}  // namespace isochron
