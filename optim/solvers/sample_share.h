// How many samples a step of adam needs.
//
// Adam divides a mean of gradients by the root mean square of single ones. Far from the optimum successive gradients agree, and noise that is
// small beside them costs nothing but time. From running means g of the gradient and q of its square (10 iterations) the share of q that
// is noise follows: noise alone has |g|^2 = q (1 - b) / (1 + b), b being the means' factor, agreeing gradients have |g|^2 = q. As many parts of
// the samples are left out as keep the noise's variance at a quarter of the signal's square, which shortens steps by a tenth. Near the optimum
// gradients turn, which counts as noise: then all samples are taken.
#pragma once
#include <vector>

namespace isochron {

class SampleShare {
 public:
  /// `most`: an iteration takes one of so many parts at least.
  explicit SampleShare(int most) : most_(most) {}

  /// The next gradient is to be made of one of so many equal parts of the samples: a power of two.
  int parts() const { return parts_; }
  /// Takes a gradient made of that into account.
  void observe(const std::vector<double>& gradient);

  /// All that a resumed run needs.
  std::vector<double> state() const;
  void restore(const std::vector<double>& state);

 private:
  int most_, parts_ = 1;
  int seen_ = 0;  ///< since parts_ changed
  double square_ = 0;
  std::vector<double> mean_;
};

}  // namespace isochron
