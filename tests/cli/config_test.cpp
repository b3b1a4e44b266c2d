// SPDX-License-Identifier: Apache-2.0
// The file behind --config.
#include <sys/stat.h>

#include "catch.h"
#include "program.h"

namespace {

const std::vector<std::string> kPlan = {"box.obj", "--pitch", "45", "--dry-run", "-q"};

Outcome with_config(const SceneFolder& folder, const std::string& text) {
  write_text(folder / "c.toml", text);
  auto all = kPlan;
  all.insert(all.end(), {"--config", "c.toml"});
  return folder.run(all);
}

}  // namespace

TEST_CASE("what a configuration file may say") {
  const SceneFolder folder;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"\xef\xbb\xbfspacing = 0.2\n", "of 0.2 x 0.2 m"},       // a byte-order mark
      {"spacing = 0.2\r\nlook = 'left'\r\n", "looking left"},  // lines of Windows
      {"altitude = 5_000\n", "7071.0678 m"},
      {"spacing = [0.2, 0.4]\n", "of 0.2 x 0.4 m"},
      {"size = \"40x50\"  # pixels\n", "40 x 50 pixels"},
      {"aim = [1, 2.5, -0.25]\n", "1, 2.5, -0.25 m"},
      {"overwrite = true\nlayers = [\"mask\", \"roof\"]\n", "layers"},
      {"scene = \"shell.obj\"\n", "box.obj"},  // the command line wins
      {"pitch = 30\n", "incidence 45 deg"},
      {"azimuth = \"0:90:30\"\n", "views      4"},
  };
  for (const auto& [text, piece] : cases) {
    const Outcome outcome = with_config(folder, text);
    INFO(text << outcome.err << outcome.out);
    CHECK(outcome.code == 0);
    CHECK(has(outcome.out, piece));
  }
  write_text(folder / "all.toml", "scene = \"box.obj\"\npitch = 45\nquiet = true\n");
  CHECK(folder.run({"--config", "all.toml"}).code == 0);
  CHECK(std::filesystem::exists(folder / "box_sar.tif"));
}

TEST_CASE("mistakes in a configuration file: one line with file, line and what to write") {
  const SceneFolder folder;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"pitch = 45\nsize = 128x128\n", "c.toml:2: expected name = value"},
      {"size = 128x128\n", "size = \"128x128\"; found 'size = 128x128' ("},
      {"\n\nlook = left\n", "c.toml:3: "},
      {"pitch = 45\npitch = 46\n", "c.toml:2: the name in 'pitch = 46' is given twice"},
      {"dry_run = true\n", "unknown option 'dry_run' (dry-run?)"},
      {"pich = 4\n", "unknown option 'pich' (pitch?)"},
      {"q = true\n", "unknown option 'q'"},
      {"overwrite = 1\n", "expected true or false, found '1'"},
      {"overwrite = \"yes\"\n", "expected true or false, found 'yes'"},
      {"verbose = 2\n", "expected true or false"},
      {"spacing = \n", "c.toml:1: "},
      {"spacing = []\n", "empty list"},
      {"spacing = [[1]]\n", "found a list"},
      {"spacing = {a = 1}\n", "c.toml:1: "},
      {"spacing = 2020-01-01\n", "found a date"},
      {"[image]\nspacing = 1\n", "there are no sections"},
      {"image.spacing = 1\n", "c.toml:1: "},
      {"config = \"other\"\n", "belongs on the command line"},
      {"help = true\n", "belongs on the command line"},
      {"pitch = 4\xff\n", "c.toml:1: "},
      {"size = \"128x128\n", "c.toml:1: "},
  };
  for (const auto& [text, piece] : cases) {
    const Outcome outcome = with_config(folder, text);
    INFO(text << outcome.err);
    CHECK(outcome.code == 3);
    CHECK(is_error_line(outcome.err, piece));
  }
}

TEST_CASE("names of thousands of parts are refused before they fill the stack") {
  const SceneFolder folder;
  std::string name;
  for (int n = 0; n < 200'000; ++n) name += "a.";
  for (const std::string& text : {name + "a = 1\n", "[" + name + "a]\n"}) {
    const Outcome outcome = with_config(folder, text);
    CHECK(outcome.code == 3);
    CHECK(has(outcome.err, "c.toml: expected a few lines"));
  }
}

TEST_CASE("a configuration must be a regular file: a pipe would wait for ever") {
  const SceneFolder folder;
  REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
  std::filesystem::create_directory(folder / "folder");
  for (const char* place : {"pipe", "folder", "/dev/zero", "absent"}) {
    const Outcome outcome = folder.run({"box.obj", "--pitch", "45", "--config", place});
    INFO(outcome.err);
    CHECK(outcome.code == 3);
    CHECK(is_error_line(outcome.err, place));
  }
  CHECK(folder.run({"box.obj", "--pitch", "45", "--config", ""}).code == 2);
}
