// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/files.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <set>
#include <string>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "sarnerf/core/text.h"
#include "scratch_folder.h"

using namespace sarnerf;

namespace {

template <class Work>
std::string refusal(Work work) {
  try {
    work();
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

/// A socket's place in the file system.
class SocketFile {
 public:
  explicit SocketFile(const std::filesystem::path& path) : descriptor_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    made_ = ::bind(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  ~SocketFile() { ::close(descriptor_); }
  SocketFile(const SocketFile&) = delete;
  SocketFile& operator=(const SocketFile&) = delete;
  bool made() const { return made_; }

 private:
  int descriptor_;
  bool made_ = false;
};

}  // namespace

TEST_CASE("regular files are read whole, empty ones too") {
  const ScratchFolder folder;
  const std::string text("a\0b\r\n", 5);
  write_text(folder / "a", text);
  write_text(folder / "empty", "");
  CHECK(read_whole_file(folder / "a") == text);
  CHECK(regular_file_size(folder / "a") == 5);
  CHECK(read_whole_file(folder / "empty").empty());
  std::filesystem::create_symlink(folder / "a", folder / "link");
  CHECK(read_whole_file(folder / "link") == text);
}

TEST_CASE("what is no regular file is refused at once, by kind and without being opened") {
  const ScratchFolder folder;
  // Opening a pipe without a writer would wait for ever.
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  const SocketFile socket(folder / "socket");
  std::vector<std::pair<std::filesystem::path, std::string>> files{
      {folder / "pipe", "a pipe"},
      {folder.path(), "a folder"},
      {"/dev/zero", "a device"},
      {folder / "absent", "no such file"}};
  if (socket.made()) files.emplace_back(folder / "socket", "a socket");
  for (const auto& [path, words] : files) {
    for (const std::string& message : {refusal([&] { (void)read_whole_file(path); }),
                                       refusal([&] { (void)sha256_of_file(path); })}) {
      INFO(path << ": " << message);
      CHECK(message.starts_with(path.string() + ": "));
      CHECK(message.find(words) != std::string::npos);
    }
  }
}

TEST_CASE("a byte-order mark of UTF-8 is skipped, other encodings are refused") {
  CHECK(without_byte_order_mark("\xef\xbb\xbfv 1", "a") == "v 1");
  CHECK(without_byte_order_mark("v 1", "a") == "v 1");
  CHECK(without_byte_order_mark("", "a").empty());
  for (const std::string& text :
       {std::string("\xff\xfev\0 \0", 6), std::string("\xfe\xff\0v\0 ", 6), std::string("v\0 \0001\0", 6),
        std::string("\0v\0 \0001", 6), std::string("\xff\xfe\0\0v\0\0\0", 8), std::string("\0\0\xfe\xff\0\0\0v", 8)}) {
    const std::string message = refusal([&] { (void)without_byte_order_mark(text, "a.obj"); });
    CHECK(message.starts_with("a.obj: "));
    CHECK(message.find("UTF-16") != std::string::npos);
  }
}

TEST_CASE("what messages repeat of a file is one line of a stated length") {
  CHECK(in_one_line("plain, \xc3\xa9") == "plain, \xc3\xa9");
  CHECK(in_one_line(std::string_view("a\n\0\x1b[2J\x7f\t", 9)) == "a???[2J??");
  CHECK(in_one_line("abcdef", 6) == "abcdef");
  CHECK(in_one_line("abcdef", 5) == "abcde…");
  // Two bytes, then three, are one character: never half of it.
  CHECK(in_one_line("ab\xc3\xa9z", 3) == "ab…");
  CHECK(in_one_line("ab\xe2\x82\xacz", 4) == "ab…");
  CHECK(in_one_line("ab\xe2\x82\xacz", 5) == "ab\xe2\x82\xac…");
  CHECK(in_one_line(std::string(100, '\xbf'), 50).size() < 60);  // no UTF-8 at all
  CHECK(in_quotes(std::string(61, 'x')) == "'" + std::string(60, 'x') + "…'");
  CHECK(in_quotes("") == "''");
  CHECK(has_control_characters(std::string_view("a\0b", 3)));
  CHECK(has_control_characters("a\nb"));
  CHECK_FALSE(has_control_characters("a b\xc3\xa9"));
}

TEST_CASE("JSON may be nested to a limit, brackets in texts do not count") {
  const auto nested = [](int depth) {
    return std::string(static_cast<std::size_t>(depth), '[') + std::string(static_cast<std::size_t>(depth), ']');
  };
  require_shallow_json(nested(kDeepestJson), "a.json");
  require_shallow_json("{\"a\": \"" + std::string(1000, '[') + "\\\"" + std::string(1000, '{') + "\"}", "a.json");
  std::string siblings = "[";
  for (int n = 0; n < 1000; ++n) siblings += "[{}],";
  require_shallow_json(siblings + "[]]", "a.json");
  const std::string message = refusal([&] { require_shallow_json("\n" + nested(kDeepestJson + 1), "a.json"); });
  CHECK(message.starts_with("a.json:2: "));
  CHECK(message.find(std::to_string(kDeepestJson)) != std::string::npos);
}

TEST_CASE("a walk visits all that lies below a folder, and enters what it is let into", "[core]") {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "a/b");
  std::filesystem::create_directories(folder / "closed/within");
  write_file_atomically(folder / "a/b/file", "text");
  std::set<std::string> found;
  walk_folder(folder.path(), [&](const std::filesystem::directory_entry& entry) {
    found.insert(entry.path().filename().string());
    return entry.path().filename() != "closed";
  });
  CHECK(found == std::set<std::string>{"a", "b", "file", "closed"});
  const auto anything = [](const std::filesystem::directory_entry&) { return true; };
  CHECK(refusal([&] { walk_folder(folder / "none", anything); }).find("none: expected a folder that can be read: ") != std::string::npos);
  CHECK(refusal([&] { walk_folder(folder / "a/b/file", anything); }).find("Not a directory") != std::string::npos);
}
