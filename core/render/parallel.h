// Work shared out to threads. Results must not depend on who does what: strands of work have accumulators of their own,
// merged in a fixed order.
#pragma once
#include <functional>
#include <vector>

namespace isochron {

/// Threads that renderers use; 0: all cores. Results do not depend on it.
void set_thread_count(int threads);

/// f(0) ... f(count - 1), in any order, on as many threads as set.
void parallel(int count, const std::function<void(int)>& f);

/// sum[i] += parts[0][i] + parts[1][i] + ... in that order.
void merge(const std::vector<std::vector<double>>& parts, std::vector<double>& sum);

}  // namespace isochron
