// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/core/files.h"

#include <string>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "scratch_folder.h"

using namespace sarnerf;

namespace {

std::string digest(const std::string& text) { return sha256_hex(std::as_bytes(std::span(text))); }

}  // namespace

TEST_CASE("the examples of FIPS 180-4") {
  CHECK(digest("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(digest("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(digest("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
        "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  CHECK(digest(std::string(1000000, 'a')) ==
        "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("the digest does not depend on how the message is cut") {
  for (std::size_t length = 50; length < 135; ++length) {
    const std::string text(length, 'x');
    Sha256 in_two, bytewise;
    const auto bytes = std::as_bytes(std::span(text));
    in_two.update(bytes.first(length / 3));
    in_two.update(bytes.subspan(length / 3));
    for (std::size_t n = 0; n < length; ++n) bytewise.update(bytes.subspan(n, 1));
    const std::string expected = digest(text);
    CHECK(in_two.hex_digest() == expected);
    CHECK(bytewise.hex_digest() == expected);
  }
}

TEST_CASE("a file has the digest of its content, a missing one is an error") {
  const ScratchFolder folder;
  write_text(folder / "abc", "abc");
  CHECK(sha256_of_file(folder / "abc") == digest("abc"));
  CHECK_THROWS_AS(sha256_of_file(folder / "absent"), InputError);
  CHECK_THROWS_AS(sha256_of_file(folder.path()), InputError);
}
