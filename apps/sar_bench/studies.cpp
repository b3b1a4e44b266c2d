// SPDX-License-Identifier: Apache-2.0
#include "studies.h"

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include <sys/resource.h>
#include <unistd.h>

#include "sarnerf/core/error.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/mpa/integrate.h"
#include "sarnerf/render/engine.h"
#include "sarnerf/scene/vdb_scene.h"

namespace sarnerf::bench {

namespace {

/// Rays of 128 bins through a fog with some denser spots, as in training.
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

nlohmann::json study_large_image(const StudyOptions& options) {
  const Scene scene = bumpy_sphere(1'000'000, 60.0);
  const SurfaceEngine engine(scene);
  StudyOptions large = options;
  large.size = 1024;
  large.spacing_m = 0.2;
  const ViewPlan plan = engine.plan(standard_view(scene, large), {});
  const auto start = std::chrono::steady_clock::now();
  engine.render(plan);
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return {{"triangles", scene.mesh.triangles.size()},
          {"size", {1024, 1024}},
          {"kept_rays", plan.n_kept_rays},
          {"build_s", engine.build_s()},
          {"render_s", elapsed.count()},
          {"peak_process_mb", static_cast<double>(usage.ru_maxrss) / 1024.0}};
}

namespace fs = std::filesystem;

nlohmann::json study_sweep(const StudyOptions& options) {
  const fs::path program = program_beside("sar_render");
  // A new folder of our own, since only its content is ever removed. mkdtemp() wants six letters X to replace.
  std::string place = (fs::temp_directory_path() / "sar_bench_sweep_XXXXXX").string();
  if (::mkdtemp(place.data()) == nullptr) throw Error("cannot create a folder like " + place);
  const fs::path folder = fs::path(place) / "sweep";
  nlohmann::json results = nlohmann::json::array();
  for (const std::string& file : options.scene_files) {
    const std::string command = quoted(program.string()) + " " + quoted(fs::absolute(file).string()) +
                                " --pitch 45 --azimuth 0:359:1 --size 128x128 --spacing 0.3 -q " +
                                options.render_flags + " -o " + quoted(folder.string()) + " > /dev/null 2>&1";
    const auto sweep = [&] {
      fs::remove_all(folder);
      if (std::system(command.c_str()) != 0) throw Error("this command failed, run it to see why: " + command);
    };
    const auto times = run_in_turn({sweep}, std::min(options.rounds, 7));
    results.push_back({{"scene", fs::path(file).stem().string()},
                       {"views", 360},
                       {"threads", thread_count()},
                       {"seconds", {{"median", times[0].median()},
                                    {"quartiles", {times[0].quantile(0.25), times[0].quantile(0.75)}},
                                    {"runs", times[0].seconds.size()}}}});
  }
  fs::remove_all(place);
  return results;
}

nlohmann::json study_threads(const StudyOptions& options, int n_threads) {
  nlohmann::json results = nlohmann::json::array();
  for (const NamedScene& named : load_scenes(options)) {
    const SurfaceEngine surface(named.scene);
    VoxeliseOptions voxelising;
    voxelising.voxel_size_m = options.spacing_m;
    const VoxelEngine voxel(named.scene, to_volume(voxelise(named.scene, voxelising)));
    const Acquisition view = standard_view(named.scene, options);
    const auto render = [&](const Engine& engine, const ViewPlan& plan, int threads) {
      return [&engine, plan, threads] {
        const ThreadLimit limit(threads);
        engine.render(plan);
      };
    };
    // The memory and time of a plan depend on the number of threads.
    ViewPlan surface_plan = surface.plan(view, {}), voxel_plan = voxel.plan(view, {});
    surface_plan.error.estimate = voxel_plan.error.estimate = false;
    const auto times = run_in_turn({render(surface, surface_plan, 1), render(surface, surface_plan, n_threads),
                                    render(voxel, voxel_plan, 1), render(voxel, voxel_plan, n_threads)},
                                   options.rounds);
    results.push_back({{"scene", named.name},
                       {"threads", n_threads},
                       {"surface_ms", times[0].median() * 1e3},
                       {"surface_speed_up", ratio_json(times[0], times[1])},
                       {"voxel_ms", times[2].median() * 1e3},
                       {"voxel_speed_up", ratio_json(times[2], times[3])},
                       {"voxel_over_surface", ratio_json(times[2], times[0])}});
  }
  return results;
}

void become_nerf_bench(int argc, char** argv, char** first) {
  std::string program = program_beside("sar_nerf_bench").string();
  std::vector<char*> arguments{program.data()};
  arguments.insert(arguments.end(), first, argv + argc);
  arguments.push_back(nullptr);
  ::execv(program.c_str(), arguments.data());
  throw Error(program + " could not be started");
}

}  // namespace sarnerf::bench
