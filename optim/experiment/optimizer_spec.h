// The optimisers: their names and keys in experiment files.
#pragma once
#include <cmath>
#include <limits>

#include "core/base/description.h"

namespace isochron {

inline constexpr int kMostIterations = std::numeric_limits<int>::max() - 2;

enum class OptimizerMethod { adam, lbfgs, levenberg_marquardt, quasi_newton };

template <>
inline constexpr auto kChoices<OptimizerMethod> = std::to_array<Choice<OptimizerMethod>>(
    {{OptimizerMethod::adam, "adam", "for many unknowns, few samples, long runs"},
     {OptimizerMethod::lbfgs, "lbfgs", "for smooth problems of some hundred unknowns"},
     {OptimizerMethod::levenberg_marquardt, "levenberg_marquardt", "for few unknowns"},
     {OptimizerMethod::quasi_newton, "quasi_newton", "for many unknowns of different units; needs no rate"}});

/// Steps shrink so that noise averages out: from iteration `start` on they halve every `half_life` iterations.
struct RateDecay {
  int start = 0;
  double half_life = 0;  ///< 0: steps do not shrink
  double factor(int iteration) const {
    return half_life > 0 && iteration > start ? std::exp2((start - iteration) / half_life) : 1;
  }
};

inline constexpr int kStopOfMethod = -1;
inline constexpr int kMostSampleParts = 1024;

struct OptimizerSpec {
  OptimizerMethod method = OptimizerMethod::adam;
  /// adam: scales of the parameter (ParameterSpec::scale) per iteration. lbfgs: length of the first trial step, same unit.
  /// levenberg_marquardt, quasi_newton: without meaning.
  double learning_rate = 0.02;
  int iterations = 100;
  double tolerance = 0;  ///< converged once the image's RMSE is at most this times the target's RMS; 0: never
  int stop_window = kStopOfMethod;  ///< see window()
  RateDecay decay = {};             ///< adam
  int sample_parts = 8;             ///< adam: of which an iteration takes one at least, see sample_share.h
  int inner_iterations = 5;         ///< lbfgs, quasi_newton: steps on the random numbers of one iteration

  /// Converged once the loss has settled over so many iterations (safeguard.h); 0: never. Unless given: 5 where an iteration
  /// solves the problem of its own random numbers, so that of ten without a visible fall none found more than noise. Steps of
  /// adam are small: 50, over which the mean gradient must be noise, too, as losses can lie on a plateau.
  int window() const {
    constexpr int kSolvingWindow = 5, kSteppingWindow = 50;
    if (stop_window != kStopOfMethod) return stop_window;
    return method == OptimizerMethod::adam ? kSteppingWindow : kSolvingWindow;
  }
};

inline void describe(Keys& keys, OptimizerSpec& optimizer) {
  const auto of = [&](OptimizerMethod method) { return only(optimizer.method, {method}); };
  keys.value("method", field::choice(optimizer.method), "how the unknowns are found");
  keys.value("learning_rate", field::positive(optimizer.learning_rate),
             "adam: about the largest step of an iteration; lbfgs: first trial step; halved whenever the loss rises",
             {.unit = "the parameter's `scale`"});
  keys.value("iterations", field::integer(optimizer.iterations, 0, kMostIterations), "at most");
  keys.value("tolerance", field::non_negative(optimizer.tolerance),
             "converged once the images' RMSE is at most this; 0: never", {.unit = "RMS of the target"});
  const auto stop = [&](Keys& inner) {
    inner.value("window", field::integer(optimizer.stop_window, 0, 100000), "iterations that are averaged; 0: never",
                {.required = true});
    inner.check([&](const YamlValue& value) {
      if (optimizer.stop_window == 1) value.fail("a window of 1 has no standard error", "window: 0, or at least 2");
    });
  };
  keys.map("stop", stop,
           "converged once the loss falls by less than its standard error; the result is the mean over the last window",
           {.unset = optimizer.stop_window == kStopOfMethod, .otherwise = "`{window: 5}`; adam: `{window: 50}`"});
  RateDecay& decay = optimizer.decay;
  const auto halving = [&](Keys& inner) {
    inner.value("half_life", field::positive(decay.half_life), "iterations after which steps are half as long",
                {.required = true});
    inner.value("start", field::integer(decay.start, 0, kMostIterations), "the iteration at which it begins");
  };
  keys.map("decay", halving, "steps shrink, so that their noise averages out",
           {.only = of(OptimizerMethod::adam), .unset = decay.half_life == 0});
  keys.value(
      "sample_parts", field::integer(optimizer.sample_parts, 1, kMostSampleParts),
      "while successive gradients agree an iteration takes 1/2, 1/4 and so on of `samples`, at least 1 over this; "
      "1: always all",
      {.only = of(OptimizerMethod::adam)});
  keys.value("inner_iterations", field::integer(optimizer.inner_iterations, 1, 1000),
             "line searches of an iteration, all on the same random numbers",
             {.only = only(optimizer.method, {OptimizerMethod::lbfgs, OptimizerMethod::quasi_newton})});
}

}  // namespace isochron
