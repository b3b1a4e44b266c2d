// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <vector>

#include "process.h"
#include "values.h"

namespace sarnerf::app {

/// How many values an option takes, and how they are separated.
struct Several {
  char separator = '\0';       ///< between values in one text; '\0': the text is one value
  bool one_at_a_time = false;  ///< the option takes only one argument each time it is given
  int most = 0;                ///< greatest number of values; 0: any number
};

/// A program's command line: its options, the variables that receive their values, and the order in which they are
/// read. Help and version go to stdout. `--config` (TOML) supplies what the command line omits. Every error is one
/// UsageError or, for the configuration file itself, one InputError.
///
/// parse() first splits the command line and refuses unknown options and names. Then it runs the steps in the order
/// in which they were added: each option that was given, and each then(). So the order of add() is the order of help
/// and of errors.
class CommandLine {
 public:
  /// `footer` stands below the options in help.
  CommandLine(std::string name, std::string description, std::string footer);
  ~CommandLine();

  /// Starts a group: the title under which help shows the options added from now on, and whether configuration files
  /// may set them.
  void begin_group(std::string title, bool in_files = true);

  /// Adds an option "-o,--output" or a positional argument "SCENE". The present content of `value` is the default:
  /// help shows it, and it stays if the option is not given. An empty optional has no default.
  template <class T, class V>
  void add(const char* name, T& value, const Kind<V>& kind, const char* help) {
    std::string shown;
    if constexpr (!std::is_same_v<T, std::optional<V>>) {
      shown = kind.show(static_cast<V>(value));
    } else if (value) {
      shown = kind.show(*value);
    }
    add_text(name, {kind.type, shown, kind.names, help},
             [&value, read = kind.read](const std::string& option, const std::string& text) {
               value = static_cast<T>(read(option, text));
             });
  }

  /// The same for a list: the values that are given replace those in `values`.
  template <class T, class V>
  void add_list(const char* name, std::vector<T>& values, const Kind<V>& kind, const char* help, const Several& several) {
    add_texts(name, {kind.type, {}, {}, help}, several,
              [&values, read = kind.read](const std::string& option, const std::vector<std::string>& texts) {
                values.clear();
                for (const std::string& text : texts) values.push_back(static_cast<T>(read(option, text)));
              });
  }

  /// `flag` becomes true if the option is given. It is set before the first step.
  void add_flag(const char* name, bool& flag, const char* help);

  /// Refuses an option of an older version, on the command line and in configuration files. `instead`: what replaces it. Help does not
  /// show the option.
  void refuse_replaced(const char* name, const std::string& instead);

  /// Makes the option mandatory.
  void require(const char* name);

  /// Declares options that set the same quantity. If the command line gives one of them, the configuration file's
  /// values for all of them are ignored. Contradictions within one source are left to the caller.
  void same_meaning(std::vector<std::string> long_names);

  /// Adds a step that concerns several options: checks for contradictions, and defaults that depend on other values.
  void then(std::function<void()> step);

  /// Reads these options after all others added so far, so that errors in the others are reported first. Ignores
  /// names that were not added.
  void read_later(const std::vector<std::string>& names);

  /// Adds --threads, --max-memory, -q, -v, --config, --version. Call last: help shows them last.
  void add_shared_options();

  /// Returns false if help or version was requested and has been printed. An option with an empty text is an error.
  bool parse(int argc, char** argv);

  // The functions below are valid from the first step on.

  /// Whether the option was given, on the command line or in the configuration file.
  bool given(const std::string& name) const;

  /// Long names, without dashes, of all options that were given.
  std::set<std::string> given() const;

  /// An option's text as it was given; empty where it was not.
  std::string text(const std::string& name) const;

  SharedOptions shared_options() const;

 private:
  struct Form {
    std::string type, shown;
    std::vector<std::string> names;
    const char* help;
  };
  struct Parser;
  void add_text(const char* name, const Form& form,
                std::function<void(const std::string& option, const std::string& text)> read);
  void add_texts(const char* name, const Form& form, const Several& several,
                 std::function<void(const std::string& option, const std::vector<std::string>& texts)> read);

  std::unique_ptr<Parser> parser_;
};

/// Incidences (deg) from --pitch or --depression. Both options must be added with the same variable for their values.
/// Throws UsageError if the two contradict each other.
Kind<std::vector<double>> incidences_deg(const CommandLine& command);

/// Height of the radar (--altitude) or its distance to the aim point (--slant-range), in metres. Throws UsageError if
/// both are given.
Kind<double> radar_distance_m(const CommandLine& command);

}  // namespace sarnerf::app
