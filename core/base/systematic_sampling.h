// Some of many, each with a probability in proportion to its weight.
#pragma once

namespace isochron {

/// Keeps about `kept` of the n entries (at most one more), in their order, each with a probability in proportion to its
/// weight or certainly, by systematic sampling with one number, u in (0, 1): of neighbours that together weigh as much as
/// one kept entry stands for, one is kept. An entry has a `weight` >= 0 and an `inverse_probability`; both are divided by
/// the probability. Returns the number of entries kept, which come first.
template <class Entry>
int sample_systematically(Entry* entries, int n, int kept, double u) {
  double threshold = 0;
  for (int i = 0; i < n; ++i) threshold += entries[i].weight / kept;
  for (int certain = 0;;) {
    int above = 0;
    double rest = 0;
    for (int i = 0; i < n; ++i) {
      if (entries[i].weight >= threshold)
        ++above;
      else
        rest += entries[i].weight;
    }
    if (above == certain || above >= kept) break;
    certain = above;
    threshold = rest / (kept - certain);
  }
  int count = 0;
  double sum = u;
  for (int i = 0; i < n; ++i) {
    const double probability = entries[i].weight >= threshold ? 1 : entries[i].weight / threshold;
    sum += probability;
    if (sum < 1) continue;
    sum -= 1;
    entries[count] = entries[i];
    entries[count].weight /= probability;
    entries[count].inverse_probability /= probability;
    ++count;
  }
  return count;
}

}  // namespace isochron
