// SPDX-License-Identifier: Apache-2.0
#include "command_line.h"

#include <algorithm>
#include <deque>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "version.h"

#include "console.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"

namespace sarnerf::app {

namespace {

/// Long names of a parser's options, without dashes, and its positionals in lower case: "pitch", "scene".
std::vector<std::string> option_names(const CLI::App& parser) {
  std::vector<std::string> names;
  for (const CLI::Option* option : parser.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back(name);
    if (option->get_positional()) names.push_back(CLI::detail::to_lower(option->get_name(true)));
  }
  return names;
}

/// A positional by its name in lower case; null when there is none.
const CLI::Option* find_positional(const CLI::App& parser, const std::string& lower_name) {
  for (const CLI::Option* option : parser.get_options()) {
    if (option->get_positional() && CLI::detail::to_lower(option->get_name(true)) == lower_name) return option;
  }
  return nullptr;
}

/// " (--pitch?)", the known name nearest to an unknown one, or nothing; `dashes` goes before it.
std::string did_you_mean(const CLI::App& parser, const std::string& unknown, const std::string& dashes) {
  const std::string close = closest_name(unknown, option_names(parser));
  return close.empty() ? "" : " (" + dashes + close + "?)";
}

/// Reader for --config: a TOML file without sections. Names are those of the options (and of the positional, in lower
/// case); values are numbers, true or false, texts, or arrays of them for lists. It does not use CLI11's own reader,
/// which differs from version to version and does not report where it failed. Every error is an InputError that names
/// file and line.
class ConfigFile : public CLI::ConfigTOML {
 public:
  explicit ConfigFile(const CLI::App& parser) : parser_(parser) {}

  void same_meaning(std::vector<std::string> long_names) {
    groups_.push_back(std::move(long_names));
  }

  /// Called after the command line has been read. Skips options that the command line overrules (same_meaning()).
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

 private:
  bool overruled(const std::string& name) const;
  std::string file() const;

  const CLI::App& parser_;
  std::vector<std::vector<std::string>> groups_;
};

bool ConfigFile::overruled(const std::string& name) const {
  return std::any_of(groups_.begin(), groups_.end(), [&](const auto& group) {
    return std::find(group.begin(), group.end(), name) != group.end() &&
           std::any_of(group.begin(), group.end(), [&](const std::string& other) {
             return parser_.get_option("--" + other)->count() > 0;
           });
  });
}

std::string ConfigFile::file() const {
  const CLI::Option* config = parser_.get_config_ptr();
  return config->results().empty() ? "--config" : config->results().front();
}

std::vector<CLI::ConfigItem> ConfigFile::from_config(std::istream& input) const {
  const std::string path = file();
  std::vector<CLI::ConfigItem> kept;
  for (const FlatItem& found : read_flat_toml(input, path)) {
    const std::string place = path + ":" + std::to_string(found.line) + ": ";
    const CLI::Option* option = parser_.get_option_no_throw("--" + found.name);
    CLI::ConfigItem item;
    item.name = found.name;
    if (option == nullptr) {
      option = find_positional(parser_, found.name);
      if (option == nullptr) {
        throw InputError(place + "unknown option '" + found.name + "'" + did_you_mean(parser_, found.name, "") +
                         "; expected a name that " + parser_.get_name() + " --help lists, without its dashes");
      }
      item.name = option->get_name(true);
    }
    if (!option->get_configurable()) {
      throw InputError(place + "'" + found.name + "' belongs on the command line, not into a configuration file");
    }
    const bool flag = option->get_items_expected_max() == 0;
    if (flag && (found.values.size() != 1 || (found.values[0] != "true" && found.values[0] != "false"))) {
      throw InputError(place + "'" + found.name + "': expected true or false, found '" +
                       CLI::detail::join(found.values, ",") + "'");
    }
    if (overruled(found.name)) continue;
    item.inputs = {CLI::detail::join(found.values, ",")};
    kept.push_back(std::move(item));
  }
  return kept;
}

constexpr const char* kGroup = "Program";

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// Message about the arguments that no option took. The parser's own message lists them last first.
std::string unexpected_text(const CLI::App& parser) {
  const std::vector<std::string> unexpected = parser.remaining();
  for (const std::string& argument : unexpected) {
    if (!argument.starts_with('-')) continue;
    const auto begin = std::min(argument.find_first_not_of('-'), argument.size());
    const std::string name = argument.substr(begin, argument.find('=') - begin);
    return "unknown option " + argument + did_you_mean(parser, name, "--");
  }
  return "unexpected argument '" + (unexpected.empty() ? "" : unexpected.front()) + "'";
}

/// Runs before the parser opens the file: opening a pipe would block for ever.
std::string refuse_unless_file(std::string& path) {
  if (path.empty()) throw UsageError("--config: expected the name of a file, found an empty text");
  (void)regular_file_size(path);
  return {};
}

/// Refuses empty texts: a program would treat such an option as not given, which the user did not mean.
void refuse_empty(const CLI::App& parser) {
  for (const CLI::Option* option : parser.get_options()) {
    if (option->get_group().empty()) continue;  // refused with a reason of its own
    const std::vector<std::string>& texts = option->results();
    if (std::find(texts.begin(), texts.end(), "") != texts.end())
      throw UsageError(option->get_name() + ": expected a value, found an empty text; leave the option out for its default");
  }
}

/// Shows types and defaults as "TYPE [default]", with every version of CLI11.
class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() { column_width(32); }

  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text;
    if (!option->get_type_name().empty()) text += " " + option->get_type_name();
    if (!option->get_default_str().empty()) text += " [" + option->get_default_str() + "]";
    return text;
  }
};

}  // namespace

struct CommandLine::Parser {
  struct Step {
    std::string name;  ///< the option's name as passed to add(); empty: a step of then()
    std::function<void()> run;
  };

  Parser(std::string name, std::string description) : app(std::move(description), std::move(name)) {}

  CLI::App app;
  std::string group;
  bool in_files = true;
  // The parser keeps references to these.
  std::deque<std::string> texts;
  std::deque<std::vector<std::string>> lists;
  std::vector<Step> steps;
  std::string threads = "auto", max_memory = "auto";
  bool quiet = false;
  int verbose = 0;

  void put(CLI::Option& option, const Form& form) const {
    option.type_name(form.type)->configurable(in_files);
    if (!option.get_positional()) option.group(group);
    if (!form.names.empty()) option.check(CLI::IsMember(form.names).description(""));
  }
};

CommandLine::CommandLine(std::string name, std::string description, std::string footer)
    : parser_(std::make_unique<Parser>(std::move(name), std::move(description))) {
  CLI::App& app = parser_->app;
  app.set_help_flag();  // added again below: groups are shown in the order of their first option
  app.allow_config_extras(CLI::config_extras_mode::error);
  app.config_formatter(std::make_shared<ConfigFile>(app));
  app.formatter(std::make_shared<HelpFormatter>());
  app.footer(std::move(footer));
}

CommandLine::~CommandLine() = default;

void CommandLine::begin_group(std::string title, bool in_files) {
  parser_->group = std::move(title);
  parser_->in_files = in_files;
}

void CommandLine::add_text(const char* name, const Form& form,
                           std::function<void(const std::string&, const std::string&)> read) {
  std::string& text = parser_->texts.emplace_back(form.shown);
  CLI::Option* option = parser_->app.add_option(name, text, form.help);
  parser_->put(*option, form);
  if (!text.empty()) option->capture_default_str();
  parser_->steps.push_back({name, [option, &text, read = std::move(read)] {
    if (option->count() > 0) read(option->get_name(), text);
  }});
}

void CommandLine::add_texts(const char* name, const Form& form, const Several& several,
                            std::function<void(const std::string&, const std::vector<std::string>&)> read) {
  std::vector<std::string>& texts = parser_->lists.emplace_back();
  CLI::Option* option = parser_->app.add_option(name, texts, form.help);
  parser_->put(*option, form);
  option->delimiter(several.separator);
  if (several.one_at_a_time) option->allow_extra_args(false);
  if (several.most > 0) option->expected(1, several.most);
  parser_->steps.push_back({name, [option, &texts, read = std::move(read)] {
    if (option->count() > 0) read(option->get_name(), texts);
  }});
}

void CommandLine::refuse_replaced(const char* name, const std::string& instead) {
  CLI::Option* option = parser_->app.add_option(name, parser_->texts.emplace_back())->group("")->expected(0, 1);
  parser_->steps.push_back({name, [option, name = std::string(name), instead] {
    if (option->count() > 0) throw UsageError(name + " is of an older version: " + instead);
  }});
}

void CommandLine::add_flag(const char* name, bool& flag, const char* help) {
  parser_->app.add_flag(name, flag, help)->configurable(parser_->in_files)->group(parser_->group);
}

void CommandLine::require(const char* name) { parser_->app.get_option(name)->required(); }

void CommandLine::same_meaning(std::vector<std::string> long_names) {
  std::static_pointer_cast<ConfigFile>(parser_->app.get_config_formatter())->same_meaning(std::move(long_names));
}

void CommandLine::then(std::function<void()> step) { parser_->steps.push_back({"", std::move(step)}); }

void CommandLine::read_later(const std::vector<std::string>& names) {
  std::ranges::stable_partition(parser_->steps, [&](const Parser::Step& step) {
    return std::ranges::find(names, step.name) == names.end();
  });
}

void CommandLine::add_shared_options() {
  Parser& p = *parser_;
  p.app.set_help_flag("-h,--help", "Print this help and exit")->group(kGroup);
  p.app.add_option("--threads", p.threads, "Worker threads; auto: OMP_NUM_THREADS or all processors")
      ->type_name("N|auto")->capture_default_str()->group(kGroup);
  p.app.add_option("--max-memory", p.max_memory, "Refuse to start what needs more, such as 8G; auto: what is there")
      ->type_name("BYTES|auto|none")->capture_default_str()->group(kGroup);
  p.app.add_flag("-q,--quiet", p.quiet, "Print paths, warnings and errors only")->group(kGroup);
  p.app.add_flag("-v,--verbose", p.verbose, "Print details")->group(kGroup);
  same_meaning({"quiet", "verbose"});
  p.app.set_config("--config", "", "Options and scene from a TOML file (name = value); the command line wins")
      ->type_name("FILE")->check(CLI::Validator(refuse_unless_file, ""))->group(kGroup);
  p.app.set_version_flag("--version", p.app.get_name() + " " + std::string(kVersion), "Print the version and exit")
      ->group(kGroup);
}

bool CommandLine::parse(int argc, char** argv) {
  CLI::App& app = parser_->app;
  const std::string hint = "; " + app.get_name() + " --help lists the options";
  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    print_result(app.help());
    return false;
  } catch (const CLI::CallForVersion& e) {
    print_result(std::string(e.what()) + "\n");
    return false;
  } catch (const CLI::FileError& e) {
    throw InputError("--config: " + one_line(e.what()) + "; expected an existing TOML file");
  } catch (const CLI::ExtrasError&) {
    throw UsageError(unexpected_text(app) + hint);
  } catch (const CLI::ParseError& e) {
    throw UsageError(one_line(e.what()) + hint);
  }
  refuse_empty(app);
  for (const Parser::Step& step : parser_->steps) step.run();
  return true;
}

bool CommandLine::given(const std::string& name) const { return parser_->app.get_option(name)->count() > 0; }

std::set<std::string> CommandLine::given() const {
  std::set<std::string> names;
  for (const CLI::Option* option : std::as_const(parser_->app).get_options()) {
    if (option->count() == 0) continue;
    for (const std::string& name : option->get_lnames()) names.insert(name);
  }
  return names;
}

std::string CommandLine::text(const std::string& name) const {
  const CLI::Option* option = parser_->app.get_option(name);
  return option->count() > 0 ? option->results().front() : "";
}

SharedOptions CommandLine::shared_options() const {
  const Parser& p = *parser_;
  SharedOptions options;
  const CLI::Option* config = p.app.get_config_ptr();
  if (config != nullptr && config->count() > 0) options.config_file = config->results().front();
  constexpr int kMostThreads = 1'000'000;
  options.n_threads = p.threads == "auto" ? default_thread_count()
                                          : static_cast<int>(parse_whole("--threads", p.threads, 1, kMostThreads));
  options.any_memory = p.max_memory == "none";
  if (p.max_memory != "none" && p.max_memory != "auto")
    options.max_memory_bytes = parse_bytes("--max-memory", p.max_memory);
  if (p.quiet && p.verbose > 0) throw UsageError("-q and -v contradict each other: give one of them");
  options.verbosity = p.quiet ? -1 : p.verbose;
  return options;
}

Kind<std::vector<double>> incidences_deg(const CommandLine& command) {
  // Each of the two options reads both texts, so their order does not matter.
  return {"DEG", [&command](auto&, auto&) { return incidences_deg(command.text("--pitch"), command.text("--depression")); },
          [](auto&) { return std::string(); }};
}

Kind<double> radar_distance_m(const CommandLine& command) {
  return between("M", kNearestRadar_m, kFarthestRadar_m).checked([&command](auto&, auto&) {
    if (command.given("--altitude") && command.given("--slant-range"))
      throw UsageError("--altitude and --slant-range both place the radar; give one of them");
  });
}

}  // namespace sarnerf::app
