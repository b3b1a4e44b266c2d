// SPDX-License-Identifier: Apache-2.0
#include "command_line.h"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "version.h"
#include <CLI/CLI.hpp>

#include "console.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/files.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/core/text.h"
#include "values.h"

namespace sarnerf::app {

/// Long names of a parser's options, without dashes, and its positionals in lower case: "pitch", "scene".
std::vector<std::string> option_names(const CLI::App& parser);

/// A positional by its name in lower case; null when there is none.
const CLI::Option* find_positional(const CLI::App& parser, const std::string& lower_name);

/// " (--pitch?)", the known name nearest to an unknown one, or nothing; `dashes` goes before it.
std::string did_you_mean(const CLI::App& parser, const std::string& unknown, const std::string& dashes);

/// The reader behind --config: a TOML file without sections, with the names of the options (and of the
/// positional in lower case), values as numbers, true or false, texts, or arrays of them for lists. It does
/// not lean on CLI11's own reader, which differs from version to version and does not say where it failed.
/// Each complaint is an InputError that names file and line.
class ConfigFile : public CLI::ConfigTOML {
 public:
  explicit ConfigFile(const CLI::App& parser) : parser_(parser) {}

  void same_meaning(std::vector<std::string> long_names) {
    groups_.push_back(std::move(long_names));
  }

  /// Called after the command line has been read. Leaves out what the command line says in other words.
  std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

 private:
  bool overruled(const std::string& name) const;
  std::string file() const;

  const CLI::App& parser_;
  std::vector<std::vector<std::string>> groups_;
};

std::vector<std::string> option_names(const CLI::App& parser) {
  std::vector<std::string> names;
  for (const CLI::Option* option : parser.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back(name);
    if (option->get_positional()) names.push_back(CLI::detail::to_lower(option->get_name(true)));
  }
  return names;
}

const CLI::Option* find_positional(const CLI::App& parser, const std::string& lower_name) {
  for (const CLI::Option* option : parser.get_options()) {
    if (option->get_positional() && CLI::detail::to_lower(option->get_name(true)) == lower_name) return option;
  }
  return nullptr;
}

std::string did_you_mean(const CLI::App& parser, const std::string& unknown, const std::string& dashes) {
  const std::string close = closest_name(unknown, option_names(parser));
  return close.empty() ? "" : " (" + dashes + close + "?)";
}

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

namespace {

constexpr const char* kGroup = "Program";

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// The arguments that no option took, in words of their own: the parser lists them last first.
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

/// Before the parser opens the file: a pipe would wait for ever.
std::string refuse_unless_file(std::string& path) {
  if (path.empty()) throw UsageError("--config: expected the name of a file, found an empty text");
  (void)regular_file_size(path);
  return {};
}

/// Programs take an empty text for an option that was not given, which the user did not mean.
void refuse_empty(const CLI::App& parser) {
  for (const CLI::Option* option : parser.get_options()) {
    const std::vector<std::string>& texts = option->results();
    if (std::find(texts.begin(), texts.end(), "") != texts.end())
      throw UsageError(option->get_name() + ": expected a value, found an empty text; leave the option out for its default");
  }
}

/// Types and defaults as "TYPE [default]", whatever the version of CLI11.
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

CommandLine::CommandLine(std::string name, std::string description)
    : parser_(std::move(description), std::move(name)) {
  parser_.set_help_flag();  // added again below: groups are shown in the order of their first option
  parser_.allow_config_extras(CLI::config_extras_mode::error);
  parser_.config_formatter(std::make_shared<ConfigFile>(parser_));
  parser_.formatter(std::make_shared<HelpFormatter>());
}

CLI::Option* CommandLine::add_text_option(const char* name, std::string& text, const char* type,
                                          const char* help) {
  CLI::Option* option = parser_.add_option(name, text, help)->type_name(type)->group(group_);
  if (!text.empty()) option->capture_default_str();
  return option;
}

CLI::Option* CommandLine::add_flag(const char* name, bool& flag, const char* help) {
  return parser_.add_flag(name, flag, help)->group(group_);
}

void CommandLine::same_meaning(std::vector<std::string> long_names) {
  std::static_pointer_cast<ConfigFile>(parser_.get_config_formatter())
      ->same_meaning(std::move(long_names));
}

void CommandLine::add_shared_options() {
  parser_.set_help_flag("-h,--help", "Print this help and exit")->group(kGroup);
  parser_.add_option("--threads", threads_, "Worker threads; auto: OMP_NUM_THREADS or all processors")
      ->type_name("N|auto")->capture_default_str()->group(kGroup);
  parser_.add_option("--max-memory", max_memory_, "Refuse to start what needs more, such as 8G; auto: what is there")
      ->type_name("BYTES|auto|none")->capture_default_str()->group(kGroup);
  parser_.add_flag("-q,--quiet", quiet_, "Print paths, warnings and errors only")->group(kGroup);
  parser_.add_flag("-v,--verbose", verbose_, "Print details")->group(kGroup);
  same_meaning({"quiet", "verbose"});
  parser_.set_config("--config", "", "Options and scene from a file of lines name = value; the command line wins")
      ->type_name("FILE")->check(CLI::Validator(refuse_unless_file, ""))->group(kGroup);
  parser_.set_version_flag("--version", parser_.get_name() + " " + std::string(kVersion),
                           "Print the version and exit")->group(kGroup);
}

bool CommandLine::parse(int argc, char** argv) {
  try {
    parser_.parse(argc, argv);
    refuse_empty(parser_);
    return true;
  } catch (const CLI::CallForHelp&) {
    print_result(parser_.help());
  } catch (const CLI::CallForVersion& e) {
    print_result(std::string(e.what()) + "\n");
  } catch (const CLI::FileError& e) {
    throw InputError("--config: " + one_line(e.what()) + "; expected an existing TOML file");
  } catch (const CLI::ExtrasError&) {
    throw UsageError(unexpected_text(parser_) + "; " + parser_.get_name() + " --help lists the options");
  } catch (const CLI::ParseError& e) {
    throw UsageError(one_line(e.what()) + "; " + parser_.get_name() + " --help lists the options");
  }
  return false;
}

std::set<std::string> CommandLine::given() const {
  std::set<std::string> names;
  for (const CLI::Option* option : parser_.get_options()) {
    if (option->count() == 0) continue;
    for (const std::string& name : option->get_lnames()) names.insert(name);
  }
  return names;
}

SharedOptions CommandLine::shared_options() const {
  SharedOptions options;
  const CLI::Option* config = parser_.get_config_ptr();
  if (config != nullptr && config->count() > 0) options.config_file = config->results().front();
  constexpr int kMostThreads = 1'000'000;
  options.n_threads = threads_ == "auto" ? default_thread_count()
                                         : static_cast<int>(parse_whole("--threads", threads_, 1, kMostThreads));
  options.any_memory = max_memory_ == "none";
  if (max_memory_ != "none" && max_memory_ != "auto") options.max_memory_bytes = parse_bytes("--max-memory", max_memory_);
  if (quiet_ && verbose_ > 0) throw UsageError("-q and -v contradict each other: give one of them");
  options.verbosity = quiet_ ? -1 : verbose_;
  return options;
}

CLI::Validator one_of(const std::vector<std::string>& names) { return CLI::IsMember(names).description(""); }

}  // namespace sarnerf::app
