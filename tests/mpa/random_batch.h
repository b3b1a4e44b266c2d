// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "sarnerf/mpa/integrate.h"

namespace sarnerf::test {

inline constexpr Integrator kAllIntegrators[] = {Integrator::exact, Integrator::midpoint,
                                                 Integrator::paper, Integrator::paper_gated};
inline constexpr SourceForm kBothForms[] = {SourceForm::scattering, SourceForm::brightness};

inline std::vector<InstructionSet> available_instruction_sets() {
  std::vector<InstructionSet> sets;
  for (InstructionSet set :
       {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
    if (set <= best_instruction_set()) sets.push_back(set);
  }
  return sets;
}

/// Arrays of a problem that own their memory, in the precision of the kernels or of the oracle.
template <class T>
struct Problem {
  int n_rows = 0, n_range = 0;
  std::vector<std::uint32_t> ray_begin{0}, ray_row, bin;
  std::vector<T> length_m, extinction, extinction_back, source;
  SourceForm form = SourceForm::scattering;

  std::size_t n_segments() const { return bin.size(); }
  std::size_t n_pixels() const { return static_cast<std::size_t>(n_rows * n_range); }
  SegmentSpans<T> segments() const { return {ray_begin, ray_row, bin, length_m}; }
  FieldSamples<T> field() const { return {extinction, extinction_back, source, form}; }

  void add_segment(std::uint32_t j, T length, T kappa, T value) {
    bin.push_back(j);
    length_m.push_back(length);
    extinction.push_back(kappa);
    source.push_back(value);
  }
  void end_ray(std::uint32_t row) {
    ray_begin.push_back(static_cast<std::uint32_t>(bin.size()));
    ray_row.push_back(row);
  }
  template <class U>
  Problem<U> as() const {
    const auto convert = [](const std::vector<T>& v) { return std::vector<U>(v.begin(), v.end()); };
    return {n_rows,
            n_range,
            ray_begin,
            ray_row,
            bin,
            convert(length_m),
            convert(extinction),
            convert(extinction_back),
            convert(source),
            form};
  }
};

template <class T>
struct GradientArrays {
  explicit GradientArrays(const Problem<T>& p)
      : extinction(p.extinction.size()),
        extinction_back(p.extinction_back.size()),
        source(p.source.size()) {}
  std::vector<T> extinction, extinction_back, source;
  FieldGradients<T> spans() { return {extinction, extinction_back, source}; }
};

/// Rays of 0 to `longest` segments in ascending bins, some of them in front of bin 0; optical depths over
/// ten decades up to `largest_depth`, empty segments and segments of length 0 among them.
inline Problem<float> random_problem(unsigned seed, int n_rays, int longest, double largest_depth,
                                     bool two_extinctions, SourceForm form) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  Problem<float> p;
  p.n_rows = 5;
  p.n_range = 40;
  p.form = form;
  for (int q = 0; q < n_rays; ++q) {
    const int n = static_cast<int>(unit(random) * (longest + 1));
    int j = -3;
    for (int s = 0; s < n; ++s) {
      j += unit(random) < 0.7 ? 1 : 0;
      const double length = unit(random) < 0.05 ? 0.0 : 0.3 * unit(random);
      const double depth = largest_depth * std::pow(10.0, -10.0 * unit(random));
      const double kappa = unit(random) < 0.2 ? 0.0 : depth / 0.3;
      p.add_segment(j < 0 ? kNoBin : static_cast<std::uint32_t>(j % p.n_range),
                    static_cast<float>(length), static_cast<float>(kappa),
                    static_cast<float>(unit(random)));
      if (two_extinctions) p.extinction_back.push_back(static_cast<float>(kappa * unit(random)));
    }
    p.end_ray(static_cast<std::uint32_t>(unit(random) * p.n_rows));
  }
  return p;
}

}  // namespace sarnerf::test
