// SPDX-License-Identifier: Apache-2.0
#include "sweep_run.h"

#include <algorithm>

#include "sarnerf/core/atomic_file.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/dataset/display.h"
#include "sarnerf/dataset/image_file.h"

namespace sarnerf::app {
namespace {

/// Calls work(n) for [0, count): views side by side if there is memory for that, else each with all threads.
template <class Work>
void for_each_view(const Job& job, std::size_t count, const Work& work) {
  if (job.n_views_at_once <= 1) {
    for (std::size_t n = 0; n < count; ++n) work(n);
    return;
  }
  parallel_for(count, 1, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) work(n);
  });
}

}  // namespace

SweepRun::SweepRun(const Job& job, const SweepFolder& folder)
    : job_(job), folder_(folder), checksums_(folder.checksums()), finished_(job.views.size(), 0) {
  parallel_for(finished_.size(), 8, [&](std::size_t begin, std::size_t end, int) {
    for (std::size_t n = begin; n < end; ++n) {
      const auto files = files_of(n);
      finished_[n] = std::all_of(files.begin(), files.end(),
                                 [&](const std::string& name) { return checksums_.whole(name); });
    }
  });
  n_open_ = finished_.size() - n_finished();
  figures_.n_reused = n_finished();
  const auto samples = DisplayScale::sample_views(finished_.size());
  if (std::all_of(samples.begin(), samples.end(), [&](std::size_t n) { return finished_[n] != 0; })) {
    find_display({});
  }
}

std::size_t SweepRun::n_finished() const {
  return static_cast<std::size_t>(std::count(finished_.begin(), finished_.end(), 1));
}

std::vector<std::string> SweepRun::files_of(std::size_t view) const {
  std::vector<std::string> names{folder_.image_name(view), folder_.png_name(view)};
  for (const std::string& ending : layer_endings(job_.options.layers)) {
    names.push_back(folder_.layer_name(view, ending));
  }
  return names;
}

void SweepRun::find_display(const Monitor& monitor) {
  const std::vector<std::size_t> samples = DisplayScale::sample_views(finished_.size());
  std::vector<float> whites(samples.size());
  for_each_view(job_, samples.size(), [&](std::size_t s) {
    const std::size_t n = samples[s];
    if (finished_[n]) {
      whites[s] = white_level(read_image(folder_.tiff(n)));
      return;
    }
    Products products = render_view(n, monitor);
    whites[s] = white_level(products.image);
    const std::scoped_lock lock(mutex_);
    held_.emplace(n, std::move(products));
  });
  display_.emplace(whites);
}

Products SweepRun::render_view(std::size_t view, const Monitor& monitor) const {
  monitor.check();
  // Progress is told in views: rows of several at once would be noise.
  return make_products(job_, view, Monitor{nullptr, monitor.stop});
}

void SweepRun::write(std::size_t view, Products products, const Monitor& monitor) {
  const Stopwatch drawing;
  const std::vector<std::byte> picture = make_picture(products.image, job_.options.quantity, *display_);
  const std::vector<LayerFile> layers = layer_files(products, job_.options, *display_);
  products.encode_s += drawing.seconds();

  const Stopwatch writing;
  AtomicFiles files(Durability::process);
  std::vector<Checksums::File> sums;
  const auto add = [&](const std::string& name, std::span<const std::byte> bytes) {
    files.add(folder_.path() / name, bytes);
    sums.push_back({name, bytes});
  };
  add(folder_.png_name(view), picture);
  add(folder_.image_name(view), products.tiff);
  for (const LayerFile& layer : layers) add(folder_.layer_name(view, layer.ending), layer.bytes);
  files.commit();
  checksums_.add(sums);
  const double write_s = writing.seconds();

  for (const std::string& text : products.warnings) warnings_.add(job_.views[view], view, text);
  const std::scoped_lock lock(mutex_);
  finished_[view] = 1;
  sarnerf::app::add(products, figures_);
  figures_.write_s += write_s;
  monitor.report("views", figures_.n_rendered, n_open_);
}

RunFigures SweepRun::render(Console& console, const Monitor& monitor) {
  if (!display_) find_display(monitor);
  std::vector<std::size_t> open;
  for (std::size_t n = 0; n < finished_.size(); ++n) {
    if (!finished_[n]) open.push_back(n);
  }
  for_each_view(job_, open.size(), [&](std::size_t o) {
    const auto held = held_.find(open[o]);
    // Taken out in place: others look into the same map.
    write(open[o], held != held_.end() ? std::move(held->second) : render_view(open[o], monitor), monitor);
  });
  held_.clear();
  checksums_.finish();
  warnings_.print(console);
  return figures_;
}

}  // namespace sarnerf::app
