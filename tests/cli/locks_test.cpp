// SPDX-License-Identifier: Apache-2.0
// Two programs that write to one place: the second one is refused, and nothing is lost.
#include <unistd.h>

#include <csignal>

#include "catch.h"
#include "output_lock.h"
#include "program.h"
#include "sarnerf/core/error.h"

using namespace sarnerf;

namespace {

/// A view of minutes.
std::vector<std::string> slow(const std::vector<std::string>& more) {
  return with({"box.obj", "--pitch", "45", "--size", "2000x2000", "--spacing", "0.01", "--sub-rows", "64", "--elevations", "20000"},
              more);
}

/// Runs `first` until it has locked its output, then `second` beside it, then ends the first one by `signal`.
std::pair<Outcome, Outcome> beside(const SceneFolder& folder, const std::vector<std::string>& first,
                                   const std::filesystem::path& lock, const std::vector<std::string>& second, int signal) {
  Outcome other;
  bool done = false;
  const auto when_locked = [&](double) {
    if (done || !std::filesystem::exists(folder / lock)) return 0;
    done = true;
    other = folder.run(second);
    return signal;
  };
  Outcome one = sar_render(first, {folder.path(), when_locked});
  REQUIRE(done);
  return {one, other};
}

}  // namespace

TEST_CASE("the lock of a file: for one holder, named to others, gone with it") {
  const ScratchFolder folder;
  {
    const app::OutputLock lock({folder / "a.tif", folder / "a.json"});
    for (const char* taken : {"a.tif", "a.json"}) {
      try {
        const app::OutputLock second({folder / "b.tif", folder / taken});
        FAIL("two holders of " << taken);
      } catch (const UsageError& e) {
        const std::string text = e.what();
        CHECK(has(text, std::string(taken) + ": test_cli (process " + std::to_string(::getpid()) + ") is writing it"));
      }
      CHECK_FALSE(std::filesystem::exists(folder / ".b.tif.lock"));
    }
    CHECK_NOTHROW(app::OutputLock({folder / "b.tif"}));
  }
  CHECK(std::filesystem::is_empty(folder.path()));
  CHECK_NOTHROW(app::OutputLock({folder / "a.tif"}));
  // Where no file can be made, the output says so by itself.
  CHECK_NOTHROW(app::OutputLock({folder / "absent/a.tif"}));
}

TEST_CASE("two renders of one name: the second is refused at once and told by whom, even with --overwrite") {
  const SceneFolder folder;
  const auto before = folder.contents();
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{"-o", "a", "-q"}, {"-o", "a", "-q", "--overwrite"}}) {
    const auto [one, other] = beside(folder, slow({"-o", "a"}), ".a.tif.lock",
                                     [&] {
                                       std::vector<std::string> small = {"box.obj", "--pitch", "45", "--size", "8x8"};
                                       small.insert(small.end(), more.begin(), more.end());
                                       return small;
                                     }(),
                                     SIGINT);
    INFO(other.err);
    CHECK(other.code == 2);
    CHECK(is_error_line(other.err, "a.tif: sar_render (process "));
    CHECK(one.code == 130);
    CHECK(folder.contents() == before);
  }
}

TEST_CASE("other names in the folder stay free, and a killed render's lock is taken over") {
  const SceneFolder folder;
  const std::vector<std::string> small = {"box.obj", "--pitch", "45", "--size", "8x8", "-q", "-o"};
  auto b = small;
  b.push_back("b");
  const auto [killed, other] = beside(folder, slow({"-o", "a"}), ".a.tif.lock", b, SIGKILL);
  CHECK(killed.code == -SIGKILL);
  CHECK(other.code == 0);
  CHECK(std::filesystem::exists(folder / ".a.tif.lock"));
  auto a = small;
  a.push_back("a");
  const Outcome again = folder.run(a);
  INFO(again.err);
  CHECK(again.code == 0);
  for (const auto& [name, bytes] : folder.contents()) CHECK_FALSE(has(name, ".lock"));
}

TEST_CASE("a sweep's folder has one writer, who is named") {
  const SceneFolder folder;
  const auto sweep = slow({"--azimuth", "0,90", "-o", "s"});
  const auto [one, other] = beside(folder, sweep, "s/recipe.json", sweep, SIGKILL);
  INFO(other.err);
  CHECK(other.code == 2);
  CHECK(has(other.err, "s: sar_render (process "));
}

TEST_CASE("--save-volume makes its folder before the work, and nothing with --dry-run") {
  const SceneFolder folder;
  std::vector<std::string> command = {"box.obj", "--pitch", "45", "--size", "16x16", "--voxel-size", "0.25",
                                      "--save-volume", "new/deep/box.vdb", "-q", "--dry-run"};
  CHECK(folder.run(command).code == 0);
  CHECK_FALSE(std::filesystem::exists(folder / "new"));
  command.pop_back();
  const Outcome outcome = folder.run(command);
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK(std::filesystem::exists(folder / "new/deep/box.vdb"));
}
