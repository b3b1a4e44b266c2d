// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "extraction_groups.h"
#include "extraction_output.h"
#include "sarnerf/core/format.h"
#include "sarnerf/report/table.h"

namespace sarnerf::bench {
namespace {

std::string cell(const Spread& s, int digits) {
  if (!std::isfinite(s.mean)) return "-";
  return format("%.*f", digits, s.mean) +
         (s.least < s.most ? format(" (%.*f to %.*f)", digits, s.least, digits, s.most) : std::string());
}

nlohmann::json json_of(const ExtractionRun& run) {
  nlohmann::json j{{"scene", run.scene},
                   {"azimuths", run.views.n_azimuth},
                   {"pitches", run.views.n_pitch},
                   {"views", run.views.count()},
                   {"planned_s", run.planned_s},
                   {"seed", run.seed}};
  if (!run.failed.empty()) {
    j["failed"] = run.failed;
    return j;
  }
  j.update({{"training_s", run.training_s},
            {"extraction_s", run.extraction_s},
            {"iou", run.iou},
            {"visible_chamfer_m", run.chamfer_m},
            {"visible_hausdorff_m", run.hausdorff_m},
            {"carving_iou", run.carving_iou},
            {"carving_visible_chamfer_m", run.carving_chamfer_m}});
  return j;
}

}  // namespace

std::string extraction_table(const std::vector<ExtractionRun>& runs) {
  std::vector<TableColumn> columns{{"scene"}};
  for (const char* heading : {"views", "planned (s)", "training (s)", "extraction (s)", "IoU", "carving's",
                              "visible Chamfer (m)", "Hausdorff (m)"})
    columns.push_back({heading, Align::right});
  std::vector<std::vector<std::string>> rows;
  for (const ExtractionGroup& g : groups_of(runs)) {
    const auto of = [&](ExtractionQuantity quantity, int digits) { return cell(spread_of(g, quantity), digits); };
    rows.push_back({g.scene, std::to_string(g.views.count()), format("%g", g.planned_s), of(&ExtractionRun::training_s, 1),
                    of(&ExtractionRun::extraction_s, 1), of(&ExtractionRun::iou, 3), of(&ExtractionRun::carving_iou, 3),
                    of(&ExtractionRun::chamfer_m, 3), of(&ExtractionRun::hausdorff_m, 2)});
  }
  return markdown_table(columns, rows);
}

nlohmann::json extraction_json(const std::vector<ExtractionRun>& runs) {
  nlohmann::json list = nlohmann::json::array();
  for (const ExtractionRun& run : runs) list.push_back(json_of(run));
  return {{"runs", list}};
}

}  // namespace sarnerf::bench
