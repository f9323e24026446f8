#include "core/films/sinks.h"

#include <algorithm>
#include <iterator>
#include <numeric>
#include <utility>

namespace isochron {
namespace {

/// f(0), f(1) ... for all gates of a run. A number of turns that the compiler knows makes them one vector.
template <class F>
void for_each_of(const GateSet::Run& run, F&& f) {
  if (run.size == GateSet::kRun) {
    for (int k = 0; k < GateSet::kRun; ++k) f(k);
  } else {
    for (int k = 0; k < run.size; ++k) f(k);
  }
}

}  // namespace

void PrimalSink::add(int pixel, const Rgb& value, double length, GateUse) {
  if (film_.channels() == 1) {
    gates_.for_each_run(length, [&](const GateSet::Run& run) {
      double* out = film_.at(pixel, run.first, run.size);
      for_each_of(run, [&](int k) { out[k] += run.value[k] * value.r; });
    });
    return;
  }
  gates_.for_each_value(length, [&](int g, double w) {
    double* out = film_.at(pixel, g);
    for (int c = 0; c < film_.channels(); ++c) out[c] += w * value[c];
  });
}

void ColumnRates::bind(const LocalDifferential& differential) {
  for (int column : touched_) rates_[column] = {};
  touched_.clear();
  differential.for_each(layout_, [&](int dof, int channel, double log_f, double length) {
    for (int i = basis_.row_begin[dof]; i < basis_.row_begin[dof + 1]; ++i) {
      const auto [column, velocity] = basis_.entries[i];
      Rates& rates = rates_[column];
      if (!std::exchange(rates.touched, true)) touched_.push_back(column);
      for (int c = 0; c < 3; ++c)
        if (channel < 0 || channel == c) rates.log_f[c] += log_f * velocity;
      rates.length += length * velocity;
    }
  });
}

void TangentSink::add(int pixel, const Rgb& value, double length, GateUse use) {
  if (films_[0].channels() == 1) {
    gates_.for_each_run(length, [&](const GateSet::Run& run) {
      for (int column : rates_.touched()) {
        const double log_f = value.r * rates_[column].log_f[0],
                     along = value.r * slope_factor(use) * rates_[column].length;
        double* out = films_[column].at(pixel, run.first, run.size);
        for_each_of(run, [&](int k) { out[k] += log_f * run.value[k] + along * run.slope[k]; });
      }
    });
    return;
  }
  gates_.for_each_derivative(length, [&](int g, double w, double slope) {
    for (int column : rates_.touched())
      splat(column, pixel, g, value, w, slope_factor(use) * slope * rates_[column].length);
  });
}

void TangentSink::add_length_rate(int pixel, int gate, const Rgb& value) {
  for (int column : rates_.touched()) splat(column, pixel, gate, value, 0, rates_[column].length);
}

void TangentSink::splat(int column, int pixel, int gate, const Rgb& value, double w, double length_part) {
  const Film& film = films_[column];
  double* out = film.at(pixel, gate);
  for (int c = 0; c < film.channels(); ++c) out[c] += value[c] * (w * rates_[column].log_f[c] + length_part);
}

void AdjointSink::add(int pixel, const Rgb& value, double length, GateUse use) {
  const std::size_t count = adjoints_.size();
  std::size_t first = 0;
  for (; first + kAdjointsTogether <= count; first += kAdjointsTogether)
    add<kAdjointsTogether>(first, pixel, value, length, use);
  for (; first < count; ++first) add<1>(first, pixel, value, length, use);
}

template <int N>
void AdjointSink::add(std::size_t first, int pixel, const Rgb& value, double length, GateUse use) {
  // All gates collapse into one function of length: a(l) = sum_g adjoint_g W_g(l), and its slope.
  Pull pulls[N];
  const GatedImage* adjoints = &adjoints_[first];
  if (adjoints->channels == 1) {
    double values[N][GateSet::kRun] = {}, slopes[N][GateSet::kRun] = {};
    gates_.for_each_run(length, [&](const GateSet::Run& run) {
      const std::size_t begin = adjoints->index(pixel, run.first);
      for (int i = 0; i < N; ++i) {
        const double* a = &adjoints[i].data[begin];
        for_each_of(run, [&](int k) {
          values[i][k] += a[k] * run.value[k];
          slopes[i][k] += a[k] * run.slope[k];
        });
      }
    });
    for (int i = 0; i < N; ++i) {
      pulls[i].weight.r = std::accumulate(values[i], std::end(values[i]), 0.0) * value.r;
      pulls[i].slope = std::accumulate(slopes[i], std::end(slopes[i]), 0.0) * value.r;
    }
  } else {
    gates_.for_each_derivative(length, [&](int g, double w, double slope) {
      for (int i = 0; i < N; ++i) {
        const double* a = &adjoints[i].data[adjoints->index(pixel, g)];
        for (int c = 0; c < adjoints->channels; ++c) {
          pulls[i].weight[c] += a[c] * w * value[c];
          pulls[i].slope += a[c] * slope * value[c];
        }
      }
    });
  }
  for (Pull& pull : pulls) pull.slope *= slope_factor(use);
  scatter(first, pulls);
}

void AdjointSink::add_length_rate(int pixel, int gate, const Rgb& value) {
  for (std::size_t which = 0; which < adjoints_.size(); ++which) {
    const GatedImage& adjoint = adjoints_[which];
    const double* a = &adjoint.data[adjoint.index(pixel, gate)];
    Pull pull[1];
    for (int c = 0; c < adjoint.channels; ++c) pull[0].slope += a[c] * value[c];
    scatter(which, pull);
  }
}

template <int N>
void AdjointSink::scatter(std::size_t first, const Pull (&pulls)[N]) {
  if (std::all_of(pulls, std::end(pulls), [](const Pull& pull) { return pull.slope == 0 && pull.weight.is_black(); }))
    return;
  double sums[N];
  for (int i = 0; i < N; ++i) sums[i] = pulls[i].weight.r + pulls[i].weight.g + pulls[i].weight.b;
  differential_->for_each(layout_, [&](int dof, int channel, double log_f, double length) {
    if (!basis_.differentiates(dof)) return;
    double* out = gradient_.at(static_cast<std::size_t>(dof) * adjoints_.size() + first, N);
    for (int i = 0; i < N; ++i)
      out[i] += (channel < 0 ? sums[i] : pulls[i].weight[channel]) * log_f + pulls[i].slope * length;
  });
}

}  // namespace isochron
