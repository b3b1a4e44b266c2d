// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/files.h"

#include <algorithm>
#include <string>

#include "catch.h"
#include "file_size_limit.h"
#include "sarnerf/core/error.h"
#include "scratch_folder.h"

using namespace sarnerf;

namespace {

std::size_t n_entries(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}

}  // namespace

TEST_CASE("files appear at commit, all of them, and leave nothing else behind") {
  for (const Durability durability : {Durability::process, Durability::power}) {
    const ScratchFolder folder;
    AtomicFiles files(durability);
    files.add(folder / "a", std::string_view("first"));
    files.add(folder / "b", std::string_view(""));
    CHECK_FALSE(std::filesystem::exists(folder / "a"));
    files.commit();
    CHECK(read_text(folder / "a") == "first");
    CHECK(read_text(folder / "b").empty());
    CHECK(n_entries(folder.path()) == 2);
  }
}

TEST_CASE("what was there before stays until commit, and for good without it") {
  const ScratchFolder folder;
  write_text(folder / "a", "old");
  {
    AtomicFiles files;
    files.add(folder / "a", std::string_view("new"));
    CHECK(read_text(folder / "a") == "old");
  }
  CHECK(read_text(folder / "a") == "old");
  CHECK(n_entries(folder.path()) == 1);
  write_file_atomically(folder / "a", "new");
  CHECK(read_text(folder / "a") == "new");
}

TEST_CASE("a disk that fills up leaves the old file and says what happened") {
  const ScratchFolder folder;
  write_text(folder / "a", "old");
  std::string message;
  {
    const FileSizeLimit limit(1000);
    AtomicFiles files;
    files.add(folder / "b", std::string(900, 'b'));
    try {
      files.add(folder / "a", std::string(2000, 'a'));
    } catch (const Error& error) {
      message = error.what();
    }
  }
  CHECK(message.find((folder / "a").string()) == 0);
  CHECK(message.find("ulimit") != std::string::npos);
  CHECK(read_text(folder / "a") == "old");
  CHECK(n_entries(folder.path()) == 1);
}

TEST_CASE("temporary files are told from others by name") {
  CHECK(AtomicFiles::is_temporary("folder/.view_001.tif.4711-3.partial"));
  CHECK_FALSE(AtomicFiles::is_temporary("folder/view_001.tif"));
  CHECK_FALSE(AtomicFiles::is_temporary("folder/notes.partial"));
}

TEST_CASE("folders that cannot be are errors that name them") {
  const ScratchFolder folder;
  write_text(folder / "file", "");
  CHECK_THROWS_AS(make_folder(folder / "file"), Error);
  CHECK_THROWS_AS(make_folder(folder / "file" / "below"), Error);
  CHECK_THROWS_AS(require_writable(folder / "file"), Error);
  CHECK_THROWS_AS(require_writable(folder / "absent"), Error);
  make_folder(folder / "one" / "two");
  make_folder(folder / "one" / "two");
  require_writable(folder / "one" / "two");
  CHECK(n_entries(folder / "one" / "two") == 0);
}
