// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <cstring>
#include <random>

#include "catch.h"
#include "vdb/vdb_file.h"
#include "vdb_scenes.h"

#ifdef __SANITIZE_ADDRESS__
// Values that do not unzip make OpenVDB throw while it holds a node in a plain pointer: what it had read of
// that node is lost. Nothing of ours can free it, and a program that refuses its input ends.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:readTopology"; }
#endif

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

struct Sample {
  std::string name, bytes;
};

/// Files of every structure that the reader knows: compressions, half floats, vectors, tiles.
std::vector<Sample> samples() {
  openvdb::initialize();
  std::vector<Sample> found;
  const ScratchFolder folder;
  const auto path = folder.path() / "a.vdb";
  for (const std::uint32_t compression : {0u, 1u, 2u, 3u, 4u, 6u}) {
    auto grids = cosine_grids(30);
    grids->extinction->tree().addTile(2, {128, 0, 0}, 0.5f, true);
    grids->brightness[0]->tree().addTile(3, {8192, 0, 0}, 0.5f, true);
    grids->exponent->setSaveFloatAsHalf(true);
    openvdb::MetaMap metadata;
    metadata.insertMeta("brightness_basis", openvdb::StringMetadata("cosine"));
    write_foreign(path, grids->all(), metadata, compression);
    found.push_back({"compression " + std::to_string(compression), bytes_of(path)});
  }
  return found;
}

/// Damaged files of each kind. SARNERF_FUZZ=20000 asks for a long run by hand.
int n_damaged() {
  const char* wanted = std::getenv("SARNERF_FUZZ");
  return wanted ? std::atoi(wanted) : 40;
}

/// Reads the bytes as a file; true when they are a volume, false when they are refused in an orderly way.
bool is_read(const ScratchFolder& folder, const std::string& bytes) {
  const auto path = folder.write("hostile.vdb", bytes);
  VdbReadOptions options;
  options.max_memory_bytes = 200'000'000;
  try {
    to_volume(read_vdb(path, options), 20'000'000);
  } catch (const InputError& error) {
    REQUIRE(contains(error.what(), "hostile.vdb"));
    return false;
  } catch (const UsageError&) {  // sizes that are possible, but larger than allowed
    return false;
  }
  return true;
}

}  // namespace

TEST_CASE("a walk over a tree ends where OpenVDB ends it", "[vdb]") {
  const ScratchFolder folder;
  for (const Sample& sample : samples()) {
    INFO(sample.name);
    const VdbFile file = scan_vdb_file(sample.bytes, "a.vdb");
    CHECK(file.grids.size() == 5);
    CHECK(file.grids.back().end == sample.bytes.size());
    VdbReadOptions options;  // reads all grids: each must end at its end
    CHECK_NOTHROW(read_vdb(folder.write("a.vdb", sample.bytes), options));
  }
}

TEST_CASE("truncated volumes are refused", "[vdb]") {
  const ScratchFolder folder;
  std::mt19937 random(1);
  for (const Sample& sample : samples()) {
    INFO(sample.name);
    std::vector<std::size_t> lengths{0, 1, 7, 8, 12, 20, 21, 57, 60};
    std::uniform_int_distribution<std::size_t> any(61, sample.bytes.size() - 1);
    for (int n = 0; n < 25; ++n) lengths.push_back(any(random));
    for (std::size_t back = 1; back < 20; ++back) lengths.push_back(sample.bytes.size() - back);
    for (const std::size_t length : lengths) {
      INFO("the first " << length << " bytes of " << sample.bytes.size());
      REQUIRE_FALSE(is_read(folder, sample.bytes.substr(0, length)));
    }
  }
}

TEST_CASE("volumes with damaged bytes are read or refused, and nothing worse", "[vdb]") {
  const ScratchFolder folder;
  std::mt19937 random(2);
  int n_refused = 0;
  for (const Sample& sample : samples()) {
    // Most of what lengths and structure there is lies at the beginning of a file and of its grids.
    const VdbFile file = scan_vdb_file(sample.bytes, "a.vdb");
    std::vector<std::size_t> begins{0};
    for (const VdbFileGrid& grid : file.grids) begins.push_back(grid.transform_begin);
    for (int n = 0; n < n_damaged(); ++n) {
      std::string bytes = sample.bytes;
      const bool anywhere = n % 2 == 0;
      const std::size_t begin = anywhere ? 0 : begins[static_cast<std::size_t>(n) % begins.size()];
      const std::size_t end = anywhere ? bytes.size() : std::min(bytes.size(), begin + 400);
      std::uniform_int_distribution<std::size_t> place(begin, end - 1);
      std::uniform_int_distribution<int> value(0, 255);
      const int n_bytes = 1 + n % 4;
      for (int b = 0; b < n_bytes; ++b) bytes[place(random)] = static_cast<char>(n % 5 == 0 ? 0xff : value(random));
      n_refused += !is_read(folder, bytes);
    }
  }
  CHECK(n_refused > 20);
}

TEST_CASE("lengths that promise more than the file holds allocate nothing", "[vdb]") {
  const ScratchFolder folder;
  const std::string good = samples().front().bytes;
  // The number of metadata entries, the length of the first name, and the number of grids' tiles.
  const VdbFile file = scan_vdb_file(good, "a.vdb");
  const std::size_t topology = file.grids[0].transform_begin;
  for (const std::size_t at : {std::size_t{57}, std::size_t{61}, topology}) {
    std::string bytes = good;
    const std::uint32_t huge = 0xfffffff0u;
    std::memcpy(bytes.data() + at, &huge, sizeof huge);
    CHECK_FALSE(is_read(folder, bytes));
  }
}

TEST_CASE("a type that would tear the message is repeated in one line", "[vdb]") {
  const ScratchFolder folder;
  auto density = random_floats("density", 3, 0.0f, 1.0f);
  write_foreign(folder.path() / "a.vdb", {density});
  std::string bytes = bytes_of(folder.path() / "a.vdb");
  const std::size_t at = bytes.find("Tree_float_5_4_3");
  REQUIRE(at != std::string::npos);
  bytes[at + 8] = '\n';
  const auto path = folder.write("a.vdb", bytes);
  CHECK(contains(message_of<InputError>([&] { read_vdb(path, {}); }), "expected values of type float, found flo?t"));
}

TEST_CASE("files that are none of OpenVDB's are refused by their first bytes", "[vdb]") {
  const ScratchFolder folder;
  const auto complaint = [&](const std::string& bytes) {
    const auto path = folder.write("a.vdb", bytes);
    return message_of<InputError>([&] { read_vdb(path, {}); });
  };
  CHECK(contains(complaint("hello, this is no volume"), "expected an OpenVDB file"));
  CHECK(contains(complaint(""), "a.vdb"));
  CHECK(contains(message_of<InputError>([&] { read_vdb(folder.path() / "missing.vdb", {}); }), "missing.vdb"));
  CHECK(contains(message_of<InputError>([&] { read_vdb(folder.path(), {}); }), folder.path().string()));
  std::string bytes = samples().front().bytes;
  bytes[8] = static_cast<char>(225);
  CHECK(contains(complaint(bytes), "found version 225"));
}
