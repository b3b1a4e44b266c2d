// SPDX-License-Identifier: Apache-2.0
#include "browser.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <stdexcept>
#include <thread>

namespace {

using json = nlohmann::json;

/// A browser that says nothing for so long is stuck.
constexpr int kPatience_ms = 120000;

/// The protocol's ends in the browser's process.
constexpr int kReadsFrom = 3, kWritesTo = 4;

[[noreturn]] void become_browser(const std::string& program, const std::filesystem::path& profile,
                                 int in, int out) {
  std::vector<std::string> arguments{program,
                                     "--headless",
                                     "--no-sandbox",
                                     "--disable-gpu",
                                     "--disable-background-networking",
                                     "--disable-dev-shm-usage",
                                     "--no-first-run",
                                     "--hide-scrollbars",
                                     "--remote-debugging-pipe",
                                     "--user-data-dir=" + (profile / "profile").string()};
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  const int log = ::open((profile / "log").c_str(), O_WRONLY | O_CREAT, 0600);
  // The pipes' numbers may be 3 and 4 already, crosswise: first out of the way.
  const int safe_in = ::fcntl(in, F_DUPFD, 10), safe_out = ::fcntl(out, F_DUPFD, 10);
  ::setpgid(0, 0);
  if (::dup2(log, 1) < 0 || ::dup2(log, 2) < 0 || ::dup2(safe_in, kReadsFrom) < 0 ||
      ::dup2(safe_out, kWritesTo) < 0) {
    ::_exit(127);
  }
  ::execv(program.c_str(), argv.data());
  ::_exit(127);
}

std::string text_of(const json& remote_object) {
  for (const char* key : {"value", "description"}) {
    if (remote_object.contains(key)) return remote_object[key].dump();
  }
  return remote_object.dump();
}

std::string from_base64(const std::string& text) {
  const auto digit = [](char c) {
    if (c >= 'A' && c <= 'Z') return c - 'A';
    if (c >= 'a' && c <= 'z') return c - 'a' + 26;
    if (c >= '0' && c <= '9') return c - '0' + 52;
    return c == '+' ? 62 : 63;
  };
  std::string bytes;
  unsigned bits = 0;
  int n_bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | unsigned(digit(c));
    n_bits += 6;
    if (n_bits < 8) continue;
    n_bits -= 8;
    bytes += char(bits >> n_bits & 255u);
  }
  return bytes;
}

}  // namespace

Browser::Browser(const std::string& program) {
  std::array<int, 2> down{}, up{};
  if (::pipe2(down.data(), O_CLOEXEC) != 0 || ::pipe2(up.data(), O_CLOEXEC) != 0) {
    throw std::runtime_error("browser: no pipes");
  }
  process_ = ::fork();
  if (process_ == 0) become_browser(program, profile_.path(), down[0], up[1]);
  ::close(down[0]);
  ::close(up[1]);
  to_browser_ = down[1];
  from_browser_ = up[0];
  std::signal(SIGPIPE, SIG_IGN);  // a browser that does not start is an exception, not the end

  const json target = call("Target.createTarget", {{"url", "about:blank"}});
  session_ = call("Target.attachToTarget", {{"targetId", target["targetId"]}, {"flatten", true}})
                 .at("sessionId")
                 .get<std::string>();
  for (const char* domain : {"Page", "Runtime", "Log", "Network"})
    call(domain + std::string(".enable"));
}

Browser::~Browser() {
  ::close(to_browser_);  // asks it to end
  ::close(from_browser_);
  for (int n = 0; n < 100 && ::waitpid(process_, nullptr, WNOHANG) == 0; ++n) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  ::kill(-process_, SIGKILL);  // its helpers, and itself when it did not
  ::waitpid(process_, nullptr, 0);
}

json Browser::next_message() {
  for (;;) {
    if (const auto end = unread_.find('\0'); end != std::string::npos) {
      json message = json::parse(unread_.substr(0, end));
      unread_.erase(0, end + 1);
      return message;
    }
    pollfd ready{from_browser_, POLLIN, 0};
    if (::poll(&ready, 1, kPatience_ms) <= 0) throw std::runtime_error("browser: no answer");
    std::array<char, 65536> buffer;
    const ssize_t n = ::read(from_browser_, buffer.data(), buffer.size());
    if (n <= 0) throw std::runtime_error("browser: it ended:\n" + read_text(profile_ / "log"));
    unread_.append(buffer.data(), std::size_t(n));
  }
}

void Browser::note_event(const json& message) {
  const std::string method = message.value("method", "");
  if (method == "Page.loadEventFired") loaded_ = true;
  if (method == "Runtime.exceptionThrown") {
    complaints_.push_back(message["params"]["exceptionDetails"].value("text", "exception"));
  }
  if (method == "Log.entryAdded")
    complaints_.push_back(message["params"]["entry"]["text"].get<std::string>());
  if (method == "Runtime.consoleAPICalled") {
    std::string text = "console:";
    for (const json& argument : message["params"]["args"]) text += ' ' + text_of(argument);
    complaints_.push_back(text);
  }
  if (method == "Network.requestWillBeSent") {
    const auto url = message["params"]["request"]["url"].get<std::string>();
    if (url != url_ && url.rfind("data:", 0) != 0) requests_.push_back(url);
  }
}

json Browser::call(const std::string& method, json parameters) {
  json request{{"id", ++last_id_}, {"method", method}, {"params", std::move(parameters)}};
  if (!session_.empty()) request["sessionId"] = session_;
  const std::string text = request.dump() + '\0';
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t n = ::write(to_browser_, text.data() + sent, text.size() - sent);
    if (n <= 0) throw std::runtime_error("browser: it ended:\n" + read_text(profile_ / "log"));
    sent += std::size_t(n);
  }
  for (;;) {
    const json message = next_message();
    if (message.value("id", 0) != last_id_) {
      note_event(message);
      continue;
    }
    if (message.contains("error"))
      throw std::runtime_error(method + ": " + message["error"].dump());
    return message["result"];
  }
}

void Browser::show_as(int width_px, int height_px, bool dark) {
  call("Emulation.setDeviceMetricsOverride",
       {{"width", width_px}, {"height", height_px}, {"deviceScaleFactor", 1}, {"mobile", false}});
  call("Emulation.setEmulatedMedia",
       {{"features", {{{"name", "prefers-color-scheme"}, {"value", dark ? "dark" : "light"}}}}});
}

void Browser::open(const std::filesystem::path& file) {
  loaded_ = false;
  complaints_.clear();
  requests_.clear();
  url_ = "file://" + file.string();
  const json answer = call("Page.navigate", {{"url", url_}});
  if (answer.contains("errorText"))
    throw std::runtime_error(url_ + ": " + answer["errorText"].dump());
  while (!loaded_) note_event(next_message());
}

json Browser::evaluate(const std::string& expression) {
  const json answer =
      call("Runtime.evaluate", {{"expression", expression}, {"returnByValue", true}});
  if (answer.contains("exceptionDetails"))
    throw std::runtime_error(answer["exceptionDetails"].dump());
  return answer["result"].value("value", json());
}

std::string Browser::screenshot() {
  return from_base64(
      call("Page.captureScreenshot", {{"format", "png"}, {"captureBeyondViewport", true}})["data"]
          .get<std::string>());
}
