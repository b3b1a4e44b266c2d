// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "sarnerf/core/text.h"
#include "sarnerf/evaluation/evaluation.h"
#include "sarnerf/report/page.h"
#include "sarnerf/report/plot.h"
#include "study.h"
#include "version.h"

namespace sarnerf::app {

namespace {

/// Arms that the others are compared with.
constexpr Arm kReferences[] = {Arm::none, Arm::turned, Arm::turned_both, Arm::turned_clutter, Arm::rescaled, Arm::interpolated,
                               Arm::interpolated_turned, Arm::turned_clutter_turned};

/// What value() makes (a number in %) of each draw's cell, by the draw's number; without cells that it makes nothing of.
template <class Value>
std::map<int, double> values_of(const std::vector<Cell>& cells, Classifier classifier, Arm arm, int n_shots, const Value& value) {
  std::map<int, double> values;
  for (const Cell& cell : cells)
    if (cell.classifier == classifier && cell.arm == name(arm) && cell.n_shots == n_shots)
      if (const std::optional<double> v = value(cell)) values[cell.draw] = *v;
  return values;
}

/// Accuracy (%) of each draw.
std::map<int, double> accuracies(const std::vector<Cell>& cells, Classifier classifier, Arm arm, int n_shots,
                                 Confusion Cell::*confusion = &Cell::confusion) {
  return values_of(cells, classifier, arm, n_shots, [&](const Cell& cell) {
    return (cell.*confusion).empty() ? std::nullopt : std::optional(100.0 * accuracy(cell.*confusion));
  });
}

/// a − b of the draws that both have.
std::vector<double> differences_by_draw(const std::map<int, double>& a, const std::map<int, double>& b) {
  std::vector<double> differences;
  for (const auto& [draw, value] : a)
    if (const auto found = b.find(draw); found != b.end()) differences.push_back(value - found->second);
  return differences;
}

struct Spread {
  double mean = 0.0, deviation = 0.0, least = 0.0, most = 0.0;
};

Spread spread_of(const std::map<int, double>& values) {
  Spread s;
  const auto n = static_cast<double>(values.size());
  s.least = s.most = values.begin()->second;
  for (const auto& [draw, v] : values) {
    s.mean += v / n;
    s.least = std::min(s.least, v);
    s.most = std::max(s.most, v);
  }
  double squares = 0.0;
  for (const auto& [draw, v] : values) squares += (v - s.mean) * (v - s.mean);
  if (values.size() > 1) s.deviation = std::sqrt(squares / (n - 1.0));
  return s;
}

std::string spread_text(const std::map<int, double>& values) {
  if (values.empty()) return "–";
  const Spread s = spread_of(values);
  return values.size() > 1 ? format("%.1f ± %.1f", s.mean, s.deviation) : format("%.1f", s.mean);
}

/// What arms are compared by.
struct Measure {
  std::string title;
  std::function<std::optional<double>(const Cell&)> value;  ///< of a cell, in %
};

/// Of the test chips of these classes, those that are taken for class k (%).
std::optional<double> taken_for(const Cell& cell, std::size_t k, const std::vector<std::size_t>& classes) {
  int n = 0, n_taken = 0;
  for (const std::size_t c : classes) {
    for (const int count : cell.confusion[c]) n += count;
    n_taken += cell.confusion[c][k];
  }
  return n > 0 ? std::optional(100.0 * n_taken / n) : std::nullopt;
}

/// Accuracy, and that on exchanged backgrounds; where some classes have no chips at the test depression, the recall of those that have some,
/// and their false alarms.
std::vector<Measure> measures_of(const Options& o, const std::vector<ClassChips>& chips) {
  std::vector<Measure> measures;
  if (o.validate || std::ranges::none_of(chips, [](const ClassChips& c) { return c.test.empty(); })) {
    measures.push_back({"", [](const Cell& cell) { return std::optional(100.0 * accuracy(cell.confusion)); }});
    if (o.exchange) measures.push_back({"On the background of another class", [](const Cell& cell) { return std::optional(100.0 * accuracy(cell.across)); }});
    return measures;
  }
  std::vector<std::size_t> rest;  // classes that are tested at the depression of the shots
  for (std::size_t c = 0; c < chips.size(); ++c)
    if (chips[c].test.empty()) rest.push_back(c);
  for (std::size_t k = 0; k < chips.size(); ++k) {
    if (chips[k].test.empty()) continue;
    measures.push_back({chips[k].name + " recognised", [k](const Cell& cell) { return taken_for(cell, k, {k}); }});
    measures.push_back({chips[k].name + ", false alarms", [k, rest](const Cell& cell) { return taken_for(cell, k, rest); }});
  }
  return measures;
}

/// One comparison of two arms at one number of shots.
struct Comparison {
  std::string measure;
  Classifier classifier;
  Arm arm, reference;
  int n_shots;
  PairedDifference difference;
  double p_holm = 1.0;  ///< raised over the numbers of shots
};

/// Whether the difference of an arm to a reference is shown: not that of a reference to a later one, which is the same but for the sign.
bool is_compared(Arm arm, Arm reference) {
  const auto place = [](Arm a) { return std::ranges::find(kReferences, a) - std::begin(kReferences); };
  return place(arm) > place(reference);
}

/// Differences by draw. All chips as shots are one draw, whatever the seeds, except in a validation: nothing to compare by.
std::vector<Comparison> comparisons(const Options& o, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells) {
  std::vector<Comparison> all;
  for (const Measure& measure : measures_of(o, chips))
    for (const Classifier classifier : o.classifiers)
      for (const Arm reference : kReferences)
        for (const Arm arm : o.arms) {
          if (!is_compared(arm, reference)) continue;
          const std::size_t first = all.size();
          std::vector<double> p;
          for (const int n_shots : o.shots) {
            if (n_shots == 0 && !o.validate) continue;
            const std::vector<double> differences =
                differences_by_draw(values_of(cells, classifier, arm, n_shots, measure.value),
                                    values_of(cells, classifier, reference, n_shots, measure.value));
            if (differences.empty()) continue;
            all.push_back({measure.title, classifier, arm, reference, n_shots, paired_difference(differences)});
            p.push_back(all.back().difference.p);
          }
          const std::vector<double> raised = holm(p);
          for (std::size_t n = 0; n < raised.size(); ++n) all[first + n].p_holm = raised[n];
        }
  return all;
}

std::string accuracy_table(const Options& o, const std::vector<Cell>& cells, Classifier classifier) {
  std::vector<TableColumn> columns{{"added to the shots"}};
  for (const int n : o.shots) columns.push_back({shots_text(n) + " shots", Align::right});
  std::vector<std::vector<std::string>> rows;
  const auto add = [&](const std::string& title, Classifier who, Arm arm) {
    std::vector<std::string> row{title};
    bool any = false;
    for (const int n : o.shots) {
      const auto values = accuracies(cells, who, arm, n);
      any = any || !values.empty();
      row.push_back(spread_text(values));
    }
    if (any) rows.push_back(row);
  };
  for (const Arm arm : o.arms) add(std::string(name(arm)), classifier, arm);
  if (classifier != Classifier::background) add("(four corners of the shots alone)", Classifier::background, Arm::none);
  return markdown_table(columns, rows);
}

/// Where the classifier's cells were made, if not all at one place; empty if they were. Cells of older versions do not say it.
std::string places_text(const std::vector<Cell>& cells, Classifier classifier) {
  std::map<std::string, std::size_t> n_of_device;
  for (const Cell& cell : cells)
    if (cell.classifier == classifier) ++n_of_device[cell.device.empty() ? "not recorded" : cell.device];
  if (!is_network(classifier) || n_of_device.size() < 2) return "";
  std::string text = "\n*Trained on different devices or numbers of threads:";
  for (const auto& [device, n] : n_of_device) text += (text.back() == ':' ? " " : "; ") + device + ", " + counted(n, "cell");
  return text + ". The same training there gives accuracies that differ by about a point.*\n";
}

std::string difference_table(const Options& o, const std::vector<Comparison>& all, const std::string& measure, Classifier classifier) {
  std::vector<TableColumn> columns{{"difference"}};
  for (const int n : o.shots) columns.push_back({shots_text(n) + " shots (points)", Align::right});
  std::vector<std::vector<std::string>> rows;
  for (const Arm reference : kReferences)
    for (const Arm arm : o.arms) {
      std::vector<std::string> row{std::string(name(arm)) + " − " + std::string(name(reference))};
      bool any = false;
      for (const int n_shots : o.shots) {
        const auto found = std::ranges::find_if(all, [&](const Comparison& c) {
          return c.measure == measure && c.classifier == classifier && c.arm == arm && c.reference == reference && c.n_shots == n_shots;
        });
        if (found == all.end()) {
          row.emplace_back("–");
          continue;
        }
        any = true;
        const PairedDifference& d = found->difference;
        row.push_back(d.n < 2 || d.low == d.high ? format("%+.1f", d.mean)
                                                 : format("%+.1f (%+.1f to %+.1f), p %.2g, from %.1f", d.mean, d.low, d.high, found->p_holm,
                                                          d.smallest_detectable));
      }
      if (any) rows.push_back(row);
    }
  return rows.empty() ? "" : markdown_table(columns, rows);
}

/// What an exchange of the test chips' background changes, paired by draw. Empty where it was not made.
std::optional<PairedDifference> change_by_exchange(const std::vector<Cell>& cells, Classifier classifier, Arm arm, int n_shots, Confusion Cell::*from,
                                                   Confusion Cell::*to) {
  const std::vector<double> changes =
      differences_by_draw(accuracies(cells, classifier, arm, n_shots, to), accuracies(cells, classifier, arm, n_shots, from));
  return changes.empty() ? std::nullopt : std::optional(paired_difference(changes));
}

/// Accuracy, what the exchange within classes costs (the control), and what that between classes costs more. Nothing without an exchange.
std::string exchange_table(const Options& o, const std::vector<Cell>& cells, Classifier classifier) {
  std::vector<TableColumn> columns{{"added to the shots"}};
  for (const int n : o.shots)
    for (const char* which : {"as measured (%)", "within classes − as measured (points)", "across − within classes (points)"})
      columns.push_back({shots_text(n) + " shots, " + which, Align::right});
  std::vector<std::vector<std::string>> rows;
  for (const Arm arm : o.arms) {
    std::vector<std::string> row{std::string(name(arm))};
    bool any = false;
    for (const int n : o.shots) {
      row.push_back(spread_text(accuracies(cells, classifier, arm, n)));
      for (const auto& [from, to] : {std::pair(&Cell::confusion, &Cell::within), std::pair(&Cell::within, &Cell::across)}) {
        const auto change = change_by_exchange(cells, classifier, arm, n, from, to);
        any = any || change.has_value();
        row.push_back(!change           ? "–"
                      : change->n < 2 || (n == 0 && !o.validate) ? format("%+.1f", change->mean)
                                      : format("%+.1f (%+.1f to %+.1f)", change->mean, change->low, change->high));
      }
    }
    if (any) rows.push_back(row);
  }
  return rows.empty() ? "" : markdown_table(columns, rows);
}

/// Recall and false alarms of the classes that have chips at the test depression; nothing where all have some.
std::string recall_table(const Options& o, const std::vector<Measure>& measures, const std::vector<Cell>& cells, Classifier classifier) {
  if (measures.front().title.empty()) return "";
  std::vector<TableColumn> columns{{"added to the shots"}};
  for (const Measure& measure : measures)
    for (const int n : o.shots) columns.push_back({format("%s, %s shots (%%)", measure.title.c_str(), shots_text(n).c_str()), Align::right});
  std::vector<std::vector<std::string>> rows;
  for (const Arm arm : o.arms) {
    std::vector<std::string> row{std::string(name(arm))};
    bool any = false;
    for (const Measure& measure : measures)
      for (const int n_shots : o.shots) {
        const auto values = values_of(cells, classifier, arm, n_shots, measure.value);
        any = any || !values.empty();
        row.push_back(spread_text(values));
      }
    if (any) rows.push_back(row);
  }
  return rows.empty() ? "" : markdown_table(columns, rows);
}

/// Answers of all draws, in per cent of the class.
std::string confusion_table(const std::vector<ClassChips>& chips, const std::vector<Cell>& cells, Classifier classifier, Arm arm,
                            int n_shots) {
  std::vector<std::vector<int>> sum(chips.size(), std::vector<int>(chips.size(), 0));
  for (const Cell& cell : cells) {
    if (cell.classifier != classifier || cell.arm != name(arm) || cell.n_shots != n_shots) continue;
    for (std::size_t a = 0; a < chips.size(); ++a)
      for (std::size_t b = 0; b < chips.size(); ++b) sum[a][b] += cell.confusion[a][b];
  }
  std::vector<TableColumn> columns{{"class (%)"}};
  for (const ClassChips& c : chips) columns.push_back({c.name, Align::right});
  std::vector<std::vector<std::string>> rows;
  for (std::size_t a = 0; a < chips.size(); ++a) {
    int total = 0;
    for (const int n : sum[a]) total += n;
    std::vector<std::string> row{chips[a].name};
    for (const int n : sum[a]) row.push_back(n == 0 ? "" : format("%.1f", 100.0 * n / total));
    rows.push_back(row);
  }
  return markdown_table(columns, rows);
}

}  // namespace

std::string shots_text(int n_shots) { return n_shots == 0 ? "all" : std::to_string(n_shots); }

std::optional<Plot> accuracy_plot(const Options& o, const std::vector<Cell>& cells, Classifier classifier) {
  Plot plot;
  plot.title = "Accuracy of " + std::string(name(classifier));
  plot.subtitle = "mean of the draws; bars from the worst to the best";
  plot.x = {"shots of each class"};
  plot.y = {"test chips recognised (%)"};
  for (const Arm arm : o.arms) {
    PlotSeries series;
    series.name = name(arm);
    for (const int n_shots : o.shots) {
      const auto values = accuracies(cells, classifier, arm, n_shots);
      if (n_shots == 0 || values.empty()) continue;
      const Spread s = spread_of(values);
      series.points.push_back({static_cast<double>(n_shots), s.mean, s.least, s.most});
    }
    std::ranges::sort(series.points, {}, &PlotPoint::x);
    if (!series.points.empty()) plot.series.push_back(series);
  }
  return plot.series.empty() ? std::nullopt : std::optional(plot);
}

std::string study_text(const Options& o, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells) {
  std::size_t n_training = 0, n_test = 0;
  for (const ClassChips& c : chips) {
    n_training += c.training.size();
    n_test += o.validate ? 0 : c.test.size();
  }
  std::string text = format("# Few-shot recognition\n\n%s of %s at %g°. ", counted(n_training, "chip").c_str(),
                            counted(chips.size(), "class", "classes").c_str(), o.training_depression_deg);
  text += o.validate ? "**A validation**: the test chips are those of sectors of 30° of azimuth that have no shots.\n"
                     : format("Tested on all %zu chips at %g°%s.\n", n_test, o.test_depression_deg,
                              o.test_rest ? ", and on those at the training depression that are no shots of classes without any" : "");
  text += format("Accuracy in %%, mean ± standard deviation over %s of shots.%s\n",
                 counted(static_cast<std::uint64_t>(o.n_draws), "draw").c_str(),
                 o.validate || std::ranges::find(o.shots, 0) == o.shots.end() ? "" : " With all chips as shots, draws differ by the seed alone.");
  const std::vector<Measure> measures = measures_of(o, chips);
  const std::vector<Comparison> compared = comparisons(o, chips, cells);
  for (const Classifier classifier : o.classifiers) {
    text += "\n## " + std::string(name(classifier)) + "\n\n";
    if (const std::string recall = recall_table(o, measures, cells, classifier); !recall.empty())
      text += format("Classes with chips at %g°: how many of these are recognised, and how many chips of the classes without any, at %g° and no shots, are "
                     "taken for them:\n\n", o.test_depression_deg, o.training_depression_deg) + recall +
              "\nAll test chips together:\n\n";
    text += accuracy_table(o, cells, classifier) + places_text(cells, classifier);
    bool any = false;
    for (const Measure& measure : measures) {
      const std::string differences = difference_table(o, compared, measure.title, classifier);
      if (differences.empty()) continue;
      any = true;
      text += "\n" + (measure.title.empty() ? "" : measure.title + ":\n\n") + differences;
    }
    if (any)
      text += "\n*Paired by draw: mean (95 % interval of Student's t), p raised by Holm's method over the numbers of shots, and the smallest "
              "true difference that the interval of a study of this size excludes from 0 in about 80 % of cases (five draws or more; without Holm's "
              "correction). Arms, references and classifiers are not corrected for.*\n";
    if (const std::string exchanged = exchange_table(o, cells, classifier); !exchanged.empty())
      text += "\nWith the background exchanged between test chips. The exchange within classes is a control: what it costs is the fault of the exchange; "
              "what the one across classes costs more is what the classifier owes to the background:\n\n" + exchanged;
  }
  return text;
}

std::string confusion_text(const Options& o, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells) {
  std::string text;
  for (const Classifier classifier : o.classifiers)
    for (const int n_shots : o.shots)
      for (const Arm arm : o.arms) {
        if (accuracies(cells, classifier, arm, n_shots).empty()) continue;
        text += format("\n### %s, %s shots, %s\n\n", std::string(name(classifier)).c_str(), shots_text(n_shots).c_str(),
                       std::string(name(arm)).c_str()) +
                confusion_table(chips, cells, classifier, arm, n_shots);
      }
  return text;
}

Json study_json(const Options& o, const std::vector<ClassChips>& chips, const std::vector<Cell>& cells) {
  Json classes = Json::array(), list = Json::array(), differences = Json::array();
  for (const ClassChips& c : chips)
    classes.push_back({{"name", c.name}, {"training_chips", c.training.size()}, {"test_chips", c.test.size()}});
  for (const Cell& cell : cells) list.push_back(Json::parse(cell_json(cell)));
  const auto number = [](double x) { return std::isfinite(x) ? Json(x) : Json(); };
  for (const Comparison& c : comparisons(o, chips, cells))
    differences.push_back({{"measure", c.measure.empty() ? "accuracy" : c.measure},
                           {"classifier", name(c.classifier)},
                           {"arm", name(c.arm)},
                           {"reference", name(c.reference)},
                           {"shots", c.n_shots},
                           {"draws", c.difference.n},
                           {"points", c.difference.mean},
                           {"low", number(c.difference.low)},
                           {"high", number(c.difference.high)},
                           {"p_holm", c.p_holm},
                           {"smallest_detectable", number(c.difference.smallest_detectable)}});
  return {{"format", "sarnerf-fewshot"},       {"version", 1},
          {"program", std::string(kProgram) + " " + std::string(kVersion)},
          {"processor", processor_name()},     {"threads", o.shared.n_threads},
          {"request", request_of(o, chips)},          {"classes", classes},
          {"differences", differences},        {"cells", list}};
}

}  // namespace sarnerf::app
