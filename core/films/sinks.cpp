#include "core/films/sinks.h"

#include <iterator>
#include <numeric>

namespace isochron {

void PrimalSink::add(int pixel, const Rgb& value, double length, GateUse) {
  if (film_.channels() == 1) {
    gates_.for_each_run(length, [&](const GateSet::Run& run) {
      double* out = film_.at(pixel, run.first, run.size);
      for (int k = 0; k < run.size; ++k) out[k] += run.value[k] * value.r;
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
  for (const VertexGradient& v : differential.vertices)
    for (int axis = 0; axis < 3; ++axis)
      for_each_column(layout_.vertex(v.vertex, axis), [&](Rates& rates, double velocity) {
        for (int c = 0; c < 3; ++c)
          if (v.channel < 0 || v.channel == c) rates.log_f[c] += v.log_f[axis] * velocity;
        rates.length += v.length[axis] * velocity;
      });
  for (const ScalarGradient& s : differential.scalars)
    for_each_column(s.dof, [&](Rates& rates, double velocity) {
      for (int c = 0; c < 3; ++c)
        if (s.channel < 0 || s.channel == c) rates.log_f[c] += s.log_f * velocity;
      rates.length += s.length * velocity;
    });
}

template <class F>
void ColumnRates::for_each_column(int dof, F&& f) {
  for (int i = basis_.row_begin[dof]; i < basis_.row_begin[dof + 1]; ++i) {
    const auto [column, coefficient] = basis_.entries[i];
    if (!rates_[column].touched) {
      rates_[column].touched = true;
      touched_.push_back(column);
    }
    f(rates_[column], coefficient);
  }
}

void TangentSink::add(int pixel, const Rgb& value, double length, GateUse use) {
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
  for (std::size_t a = 0; a < adjoints_.size(); ++a) add(a, pixel, value, length, use);
}

void AdjointSink::add(std::size_t which, int pixel, const Rgb& value, double length, GateUse use) {
  const GatedImage& adjoint = adjoints_[which];
  // All gates collapse into one function of length: a(l) = sum_g adjoint_g W_g(l), and its slope.
  Rgb weight;
  double slope_weight = 0;
  if (adjoint.channels == 1) {
    double values[GateSet::kRun] = {}, slopes[GateSet::kRun] = {};
    gates_.for_each_run(length, [&](const GateSet::Run& run) {
      const double* a = &adjoint.data[adjoint.index(pixel, run.first)];
      const auto accumulate = [&](int count) {
        for (int k = 0; k < count; ++k) {
          values[k] += a[k] * run.value[k];
          slopes[k] += a[k] * run.slope[k];
        }
      };
      // A number of turns that the compiler knows makes them one vector.
      if (run.size == GateSet::kRun) {
        accumulate(GateSet::kRun);
      } else {
        accumulate(run.size);
      }
    });
    weight.r = std::accumulate(values, std::end(values), 0.0) * value.r;
    slope_weight = std::accumulate(slopes, std::end(slopes), 0.0) * value.r;
  } else {
    gates_.for_each_derivative(length, [&](int g, double w, double slope) {
      const double* a = &adjoint.data[adjoint.index(pixel, g)];
      for (int c = 0; c < adjoint.channels; ++c) {
        weight[c] += a[c] * w * value[c];
        slope_weight += a[c] * slope * value[c];
      }
    });
  }
  scatter(which, weight, slope_factor(use) * slope_weight);
}

void AdjointSink::add_length_rate(int pixel, int gate, const Rgb& value) {
  for (std::size_t which = 0; which < adjoints_.size(); ++which) {
    const GatedImage& adjoint = adjoints_[which];
    const double* a = &adjoint.data[adjoint.index(pixel, gate)];
    double slope_weight = 0;
    for (int c = 0; c < adjoint.channels; ++c) slope_weight += a[c] * value[c];
    scatter(which, {}, slope_weight);
  }
}

void AdjointSink::scatter(std::size_t adjoint, const Rgb& weight, double slope_weight) {
  const auto add = [&](int dof, double value) {
    gradient_.add(static_cast<std::size_t>(dof) * adjoints_.size() + adjoint, value);
  };
  const double sum = weight.r + weight.g + weight.b;
  if (sum == 0 && slope_weight == 0 && weight.is_black()) return;
  for (const VertexGradient& v : differential_->vertices)
    for (int axis = 0; axis < 3; ++axis)
      if (const int dof = layout_.vertex(v.vertex, axis); basis_.differentiates(dof))
        add(dof, (v.channel < 0 ? sum : weight[v.channel]) * v.log_f[axis] + slope_weight * v.length[axis]);
  for (const ScalarGradient& s : differential_->scalars)
    if (basis_.differentiates(s.dof))
      add(s.dof, (s.channel < 0 ? sum : weight[s.channel]) * s.log_f + slope_weight * s.length);
}

}  // namespace isochron
