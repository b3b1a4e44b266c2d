// SPDX-License-Identifier: Apache-2.0
#include "study.h"

#include <algorithm>
#include <map>

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
    "  grid, surface, mlp, paper  as sar_nerf_train learns them by default. Rates and resolution follow the share of the\n"
    "             planned time that is over, so each time of --time is a run of its own\n"
    "Examples:\n"
    "  sar_nerf_bench cuboid/ --against cuboid_test/ -o study\n"
    "  sar_nerf_bench cuboid/ --against cuboid_test/ --fields grid,mlp --time 3s,10s,30s --seeds 3\n"
    "  sar_nerf_bench cuboid/ --against cuboid_test/ --time grid=2s,10s --time mlp=1m,10m --time paper=1h\n"
    "Exit codes: 0 done, 1 failure at run time, 2 usage, 3 bad input file, 130 interrupted.";

const std::vector<std::string> kFields{"grid", "surface", "mlp", "paper"};

const std::map<std::string, std::vector<double>> kTimes_s{
    {"grid", {2, 5, 10, 30}}, {"surface", {5, 10, 30}}, {"mlp", {20, 60, 300}}, {"paper", {600}}};
const std::map<std::string, std::vector<double>> kQuickTimes_s{
    {"grid", {2, 5}}, {"surface", {5}}, {"mlp", {15}}, {"paper", {30}}};

void require_field(const std::string& option, const std::string& field) {
  if (std::ranges::find(kFields, field) != kFields.end()) return;
  const std::string close = closest_name(field, kFields);
  throw UsageError(option + ": expected grid, surface, mlp or paper, found " + in_quotes(field) +
                   (close.empty() ? "" : " (" + close + "?)"));
}

std::vector<double> times_of(const std::string& list) {
  std::vector<double> times_s;
  for (const std::string& part : app::parts_of(list))
    times_s.push_back(app::parse_seconds("--time", part));
  if (times_s.empty())
    throw UsageError("--time: expected times such as 2s,10s or mlp=1m, found " + in_quotes(list));
  std::ranges::sort(times_s);
  times_s.erase(std::unique(times_s.begin(), times_s.end()), times_s.end());
  return times_s;
}

Contest contest_of(const std::string& fields, const std::vector<std::string>& times, bool quick) {
  Contest contest;
  for (const std::string& field : app::parts_of(fields)) {
    require_field("--fields", field);
    if (std::ranges::find(contest, field, &Contest::value_type::first) == contest.end())
      contest.emplace_back(field, (quick ? kQuickTimes_s : kTimes_s).at(field));
  }
  if (contest.empty())
    throw UsageError("--fields: expected some of grid, surface, mlp, paper, found " + in_quotes(fields));
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
  using namespace app;
  CommandLine command("sar_nerf_bench", kDescription, kFooter);
  Options o;
  std::string fields = "grid,mlp,paper";
  std::vector<std::string> times;
  bool quick = false;
  command.add("TRAINING", o.training, made_by("FOLDER", dataset_folder),
              "Folder with dataset.json whose views are learned from");
  command.require("TRAINING");

  command.begin_group("Study");
  command.add("--against", o.against, made_by("FOLDER", dataset_folder),
              "Dataset of the same scene whose views are predicted; those trained on are left out");
  command.require("--against");
  command.add("--fields", fields, text("LIST"), "Who takes part");
  command.add_list("--time", times, text("[FIELD=]LIST"),
                   "Planned times of the runs, of all fields or of one (10s,1m or mlp=1m,10m); may be "
                   "repeated, later ones win. Default grid=2s,5s,10s,30s mlp=20s,1m,5m paper=10m",
                   {.one_at_a_time = true});
  command.then([&] { o.contest = contest_of(fields, times, quick); });
  command.add("--seeds", o.n_seeds, whole("N", 1, 1000), "Runs of each time, seeds 1 to N");
  command.add("--views", o.n_views, whole("N", 1, 1'000'000),
              "Views of --against that all are scored on, spread over them");
  command.add_flag("--quick", quick, "Default times of grid=2s,5s mlp=15s paper=30s");

  command.begin_group("Output", /*in_files=*/false);
  command.add("-o,--output", o.output, made_by("FOLDER", without_slash), "Folder; default TRAINING_learning");
  command.add_flag("--overwrite", o.overwrite, "Replace the study that is there");
  command.add_flag("--dry-run", o.dry_run, "Print the runs and stop");
  command.add_shared_options();
  command.then([&] { o.shared = command.shared_options(); });
  if (!command.parse(argc, argv)) return std::nullopt;
  if (o.output.empty()) o.output = full_path(o.training).filename().string() + "_learning";
  return o;
}

}  // namespace sarnerf::bench
