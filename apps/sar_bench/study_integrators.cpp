// SPDX-License-Identifier: Apache-2.0
#include <random>

#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/mpa/oracle.h"
#include "studies.h"
#include "timing.h"

namespace sarnerf::bench {
namespace {

/// Rays of 128 bins through a fog with some denser spots: what training sees.
struct Workload {
  static constexpr std::uint32_t kRays = 4096, kBins = 128;
  std::vector<std::uint32_t> ray_begin, ray_row, bin;
  std::vector<float> length_m, extinction, source, gradient_extinction, gradient_source;
  std::vector<double> pixels, pixel_gradients;

  Workload() {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
    for (std::uint32_t q = 0; q < kRays; ++q) {
      ray_begin.push_back(q * kBins);
      ray_row.push_back(0);
      for (std::uint32_t j = 0; j < kBins; ++j) {
        bin.push_back(j);
        length_m.push_back(0.3f);
        extinction.push_back(uniform(random) < 0.1f ? uniform(random) : 0.01f * uniform(random));
        source.push_back(uniform(random));
      }
    }
    ray_begin.push_back(kRays * kBins);
    gradient_extinction.resize(bin.size());
    gradient_source.resize(bin.size());
    pixels.assign(kBins, 0.0);
    pixel_gradients.assign(kBins, 1.0);
  }

  SegmentSpans<float> segments() const { return {ray_begin, ray_row, bin, length_m}; }
  FieldSamples<float> field() const { return {extinction, {}, source, SourceForm::brightness}; }
  FieldGradients<float> gradients() { return {gradient_extinction, {}, gradient_source}; }
};

}  // namespace

nlohmann::json study_integrators(const StudyOptions& options) {
  Workload work;
  std::vector<InstructionSet> sets{InstructionSet::baseline};
  if (best_instruction_set() >= InstructionSet::avx2) sets.push_back(InstructionSet::avx2);
  if (best_instruction_set() >= InstructionSet::avx512) sets.push_back(InstructionSet::avx512);

  std::vector<std::function<void()>> contenders;
  for (const InstructionSet set : sets) {
    contenders.push_back([&work, set] {
      integrate(work.segments(), work.field(), Integrator::exact, Workload::kBins, work.pixels, set);
    });
    contenders.push_back([&work, set] {
      integrate_adjoint(work.segments(), work.field(), Integrator::exact, Workload::kBins,
                        work.pixel_gradients, work.gradients(), set);
    });
  }
  const auto times = run_in_turn(contenders, options.rounds);
  nlohmann::json results = nlohmann::json::array();
  const auto count = static_cast<double>(work.bin.size());
  for (std::size_t n = 0; n < sets.size(); ++n) {
    results.push_back({{"instruction_set", name(sets[n])},
                       {"forward_ns_per_segment", nanoseconds_json(times[2 * n], count)},
                       {"adjoint_ns_per_segment", nanoseconds_json(times[2 * n + 1], count)}});
  }
  return results;
}

}  // namespace sarnerf::bench
