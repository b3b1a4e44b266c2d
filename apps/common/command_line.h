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

/// How often an option may be given, and how much at once.
struct Several {
  char separator = '\0';       ///< between values in one text; none: the text is one value
  bool one_at_a_time = false;  ///< the argument behind the value is none of the option's
  int most = 0;                ///< values; 0: any number
};

/// A program's command line: which options there are, where their values go, and in what order they are read. Help and
/// version go to stdout, `--config` (TOML) fills in what the command line leaves open, and every complaint is one UsageError
/// or, for the configuration file itself, InputError.
///
/// parse() splits the command line and refuses unknown options and names; only then the steps follow, each option that was
/// given and each then(), in the order in which they were added. So the order of add() is that of help and of complaints.
class CommandLine {
 public:
  /// `footer` stands below the options in help.
  CommandLine(std::string name, std::string description, std::string footer);
  ~CommandLine();

  /// Title under which help shows the options that are added from now on, and whether configuration files may set them.
  void begin_group(std::string title, bool in_files = true);

  /// An option "-o,--output", or an argument "SCENE" without a name. What `value` holds now is the default that help
  /// shows; it stays where the option is not given. An empty optional has none.
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

  /// The same with all values that are given, which replace those that are there.
  template <class T, class V>
  void add_list(const char* name, std::vector<T>& values, const Kind<V>& kind, const char* help, const Several& several) {
    add_texts(name, {kind.type, {}, {}, help}, several,
              [&values, read = kind.read](const std::string& option, const std::vector<std::string>& texts) {
                values.clear();
                for (const std::string& text : texts) values.push_back(static_cast<T>(read(option, text)));
              });
  }

  /// True when it is given. Set before the first step.
  void add_flag(const char* name, bool& flag, const char* help);

  /// The option cannot be left out.
  void require(const char* name);

  /// Options that say the same thing differently: on the command line, one of them keeps the others out
  /// even when the configuration file sets them. Contradictions inside one source remain the caller's.
  void same_meaning(std::vector<std::string> long_names);

  /// A step for what concerns several options: contradictions, and defaults that follow from other values.
  void then(std::function<void()> step);

  /// Reads these options after all that were added so far: complaints about the others come first. Passes
  /// over names that were not added.
  void read_later(const std::vector<std::string>& names);

  /// Adds --threads, --max-memory, -q, -v, --config, --version. Call last: help shows them last.
  void add_shared_options();

  /// False when help or version was asked for and has been printed. An option without text is an error.
  bool parse(int argc, char** argv);

  // From the first step on.

  /// Whether the option was given, here or in the configuration file.
  bool given(const std::string& name) const;

  /// Long names, without dashes, of all that were.
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

/// Incidences (deg) of --pitch or --depression, which both are to be added with the same place for their values. Throws
/// UsageError where the two contradict each other.
Kind<std::vector<double>> incidences_deg(const CommandLine& command);

/// Radar to aim point or its height (m): of --altitude or --slant-range, not of both.
Kind<double> radar_distance_m(const CommandLine& command);

}  // namespace sarnerf::app
