// SPDX-License-Identifier: Apache-2.0
#include "study.h"

#include <algorithm>
#include <map>
#include <sstream>

#include "command_line.h"
#include "output_lock.h"
#include "sarnerf/core/text.h"
#include "sarnerf/core/error.h"
#include "values.h"

namespace sarnerf::bench {
namespace {

constexpr const char* kDescription =
    "Error against run time of learning: trains each field in turn, in one process, and writes held-out\n"
    "PSNR over the seconds since the start (loading of libraries and images included, scoring not) as\n"
    "learning.json, learning.md, learning.svg and learning.png. Prints the tables.";

constexpr const char* kFooter =
    "Fields:\n"
    "  grid, mlp  as sar_nerf_train learns them by default. Rates and resolution follow the share of the\n"
    "             planned time that is over, so each time of --time is a run of its own\n"
    "  plain      the paper's way in plain LibTorch: whole-image steps, nothing skipped. Its runs differ in\n"
    "             nothing but where they end: one is enough\n"
    "Examples:\n"
    "  sar_nerf_bench cuboid/ --against cuboid_test/ -o study\n"
    "  sar_nerf_bench cuboid/ --against cuboid_test/ --fields grid,mlp --time 3s,10s,30s --seeds 3\n"
    "  sar_nerf_bench cuboid/ --against cuboid_test/ --time grid=2s,10s --time mlp=1m,10m --time plain=1h\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 130 interrupted.";

const std::vector<std::string> kFields{"grid", "mlp", "plain"};

const std::map<std::string, std::vector<double>> kTimes_s{
    {"grid", {2, 5, 10, 30}}, {"mlp", {20, 60, 300}}, {"plain", {600}}};
const std::map<std::string, std::vector<double>> kQuickTimes_s{
    {"grid", {2, 5}}, {"mlp", {15}}, {"plain", {30}}};

std::vector<std::string> parts_of(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

void require_field(const std::string& option, const std::string& field) {
  if (std::ranges::find(kFields, field) != kFields.end()) return;
  const std::string close = closest_name(field, kFields);
  throw UsageError(option + ": expected grid, mlp or plain, found " + in_quotes(field) +
                   (close.empty() ? "" : " (" + close + "?)"));
}

std::vector<double> times_of(const std::string& list) {
  std::vector<double> times_s;
  for (const std::string& part : parts_of(list))
    times_s.push_back(app::parse_seconds("--time", part));
  if (times_s.empty())
    throw UsageError("--time: expected times such as 2s,10s or mlp=1m, found " + in_quotes(list));
  std::ranges::sort(times_s);
  times_s.erase(std::unique(times_s.begin(), times_s.end()), times_s.end());
  return times_s;
}

Contest contest_of(const std::string& fields, const std::vector<std::string>& times, bool quick) {
  Contest contest;
  for (const std::string& field : parts_of(fields)) {
    require_field("--fields", field);
    if (std::ranges::find(contest, field, &Contest::value_type::first) == contest.end())
      contest.emplace_back(field, (quick ? kQuickTimes_s : kTimes_s).at(field));
  }
  if (contest.empty())
    throw UsageError("--fields: expected some of grid, mlp, plain, found " + in_quotes(fields));
  for (const std::string& text : times) {
    const auto equals = text.find('=');
    if (equals == std::string::npos) {
      for (auto& [field, times_s] : contest) times_s = times_of(text);
      continue;
    }
    const std::string name = text.substr(0, equals);
    require_field("--time", name);
    const auto entry = std::ranges::find(contest, name, &Contest::value_type::first);
    if (entry == contest.end())
      throw UsageError("--time " + text + ": " + name + " takes no part; name it in --fields, too");
    entry->second = times_of(text.substr(equals + 1));
  }
  return contest;
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv) {
  app::CommandLine command("sar_nerf_bench", kDescription);
  std::string training, against, fields = "grid,mlp,plain", seeds = "1", views = "16", output;
  std::vector<std::string> times;
  bool quick = false, overwrite = false, dry_run = false;

  CLI::App& p = command.parser();
  p.add_option("TRAINING", training, "Folder with dataset.json whose views are learned from")
      ->type_name("FOLDER")
      ->required();
  const char* group = "Study";
  p.add_option("--against", against,
               "Dataset of the same scene whose views are predicted; those trained on are left out")
      ->type_name("FOLDER")
      ->required()
      ->group(group);
  p.add_option("--fields", fields, "Who takes part")
      ->type_name("LIST")
      ->capture_default_str()
      ->group(group);
  p.add_option("--time", times,
               "Planned times of the runs, of all fields or of one (10s,1m or mlp=1m,10m); may be "
               "repeated, later ones win. Default grid=2s,5s,10s,30s mlp=20s,1m,5m plain=10m")
      ->type_name("[FIELD=]LIST")
      ->allow_extra_args(false)
      ->group(group);
  p.add_option("--seeds", seeds, "Runs of each time, seeds 1 to N")
      ->type_name("N")
      ->capture_default_str()
      ->group(group);
  p.add_option("--views", views, "Views of --against that all are scored on, spread over them")
      ->type_name("N")
      ->capture_default_str()
      ->group(group);
  p.add_flag("--quick", quick, "Default times of grid=2s,5s mlp=15s plain=30s")->group(group);
  group = "Output";
  p.add_option("-o,--output", output, "Folder; default TRAINING_learning")
      ->type_name("FOLDER")
      ->configurable(false)
      ->group(group);
  p.add_flag("--overwrite", overwrite, "Replace the study that is there")
      ->configurable(false)
      ->group(group);
  p.add_flag("--dry-run", dry_run, "Print the runs and stop")->configurable(false)->group(group);
  command.add_shared_options();
  p.footer(kFooter);
  if (!command.parse(argc, argv)) return std::nullopt;

  Options o;
  o.training = app::dataset_folder(training);
  o.against = app::dataset_folder(against);
  o.contest = contest_of(fields, times, quick);
  o.n_seeds = static_cast<int>(app::parse_whole("--seeds", seeds, 1, 1000));
  o.n_views = static_cast<std::size_t>(app::parse_whole("--views", views, 1, 1'000'000));
  o.output = app::without_slash(output);
  if (o.output.empty()) o.output = app::full_path(o.training).filename().string() + "_learning";
  o.overwrite = overwrite;
  o.dry_run = dry_run;
  o.shared = command.shared_options();
  return o;
}

}  // namespace sarnerf::bench
