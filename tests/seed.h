// Seeds of the tests' random numbers. Tests have fixed seeds, so that they pass or fail the same way everywhere;
// ISOCHRON_TEST_SEED=N in the environment shifts all of them, which shows how often a test fails by chance
// (scripts/test --seeds).
#pragma once
#include <cstdint>
#include <cstdlib>

namespace isochron {

/// `seed` as it stands, or shifted by ISOCHRON_TEST_SEED. Below 2^31, as experiment files want it.
inline std::uint32_t test_seed(std::uint32_t seed) {
  const char* shift = std::getenv("ISOCHRON_TEST_SEED");
  const std::uint64_t shifted = seed + 1000003ull * (shift == nullptr ? 0 : std::strtoull(shift, nullptr, 10));
  return static_cast<std::uint32_t>(shifted % 0x7fffffff);
}

}  // namespace isochron
