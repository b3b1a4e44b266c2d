// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/image_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstring>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <random>

#include "catch.h"
#include "sarnerf/core/error.h"
#include "scratch_folder.h"

using namespace sarnerf;

namespace {

void write_bytes(const std::filesystem::path& path, const std::vector<std::byte>& bytes) {
  write_text(path, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

std::string error_of(const std::filesystem::path& path) {
  try {
    (void)read_image(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("float TIFF: every finite bit pattern comes back") {
  std::mt19937 random(7);
  for (const auto& [rows, columns] : {std::pair{1, 1}, {1, 300}, {129, 37}, {600, 601}}) {
    Image<float> image(rows, columns);
    for (float& p : image.pixels()) {
      std::uint32_t bits = 0;
      do {
        bits = static_cast<std::uint32_t>(random());
        std::memcpy(&p, &bits, sizeof p);
      } while (!std::isfinite(p));
    }
    image(0, 0) = -0.0f;
    const ScratchFolder folder;
    const auto bytes = encode_tiff(image);
    write_bytes(folder / "a.tif", bytes);
    const Image<float> back = read_image(folder / "a.tif");
    REQUIRE(back.n_azimuth() == rows);
    REQUIRE(back.n_range() == columns);
    CHECK(std::memcmp(back.pixels().data(), image.pixels().data(), image.pixels().size_bytes()) == 0);
    CHECK(encode_tiff(image) == bytes);
    CHECK(bytes.size() < image.pixels().size_bytes() + 8192);
  }
}

TEST_CASE("integer images become floats of the same value") {
  const ScratchFolder folder;
  cv::Mat codes16(2, 3, CV_16UC1);
  for (int n = 0; n < 6; ++n) codes16.at<std::uint16_t>(n / 3, n % 3) = std::uint16_t(13107 * n);
  for (const char* name : {"a.png", "a.tif"}) {
    cv::imwrite((folder / name).string(), codes16);
    const Image<float> image = read_image(folder / name);
    CHECK(image.n_azimuth() == 2);
    CHECK(image(1, 2) == 65535.0f);
    CHECK(image(0, 1) == 13107.0f);
  }
  const cv::Mat codes8(4, 5, CV_8UC1, cv::Scalar(77));
  for (const char* name : {"b.png", "b.jpg", "b.tif"}) {
    cv::imwrite((folder / name).string(), codes8);
    CHECK(read_image(folder / name)(3, 4) == 77.0f);
  }
  cv::imwrite((folder / "grey.png").string(), cv::Mat(4, 5, CV_8UC3, cv::Scalar(9, 9, 9)));
  CHECK(read_image(folder / "grey.png")(0, 0) == 9.0f);
}

TEST_CASE("a header that promises more than the file can hold is refused before anything is allocated") {
  const ScratchFolder folder;
  const auto bytes_of = [&](const char* name, const cv::Mat& mat, const std::vector<int>& parameters = {}) {
    cv::imwrite((folder / name).string(), mat, parameters);
    return read_text(folder / name);
  };
  // The bytes from `at` on, high byte first, become `value`.
  const auto altered = [](std::string bytes, std::size_t at, std::initializer_list<int> value) {
    for (const int byte : value) bytes.at(at++) = static_cast<char>(byte);
    return bytes;
  };
  const auto complaint = [&](const char* name, const std::string& bytes) {
    write_text(folder / name, bytes);
    return error_of(folder / name);
  };
  const cv::Mat grey(16, 16, CV_8UC1, cv::Scalar(77));

  const std::string png = bytes_of("a.png", grey);
  CHECK(complaint("a.png", altered(png, 16, {0, 0, 0x70, 0, 0, 0, 0x70, 0})).find("28672 x 28672") != std::string::npos);
  CHECK(complaint("a.png", altered(png, 16, {0x7f, 0xff, 0xff, 0xff})).find("promises") != std::string::npos);
  CHECK(complaint("a.png", png.substr(0, 20)).find("cut off") != std::string::npos);

  const std::string jpeg = bytes_of("a.jpg", grey);
  const std::size_t frame = jpeg.find("\xff\xc0");
  REQUIRE(frame != std::string::npos);
  CHECK(complaint("a.jpg", altered(jpeg, frame + 5, {0x70, 0, 0x70, 0})).find("28672 x 28672") != std::string::npos);
  // Each scan of a progressive file is another pass over the picture.
  const std::string scans = bytes_of("b.jpg", grey, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  std::string many = scans.substr(0, scans.size() - 2);
  const std::size_t scan = scans.rfind("\xff\xda");
  for (int n = 0; n < 100; ++n) many += scans.substr(scan, scans.size() - 2 - scan);
  CHECK(error_of(folder / "b.jpg").empty());
  CHECK(complaint("b.jpg", many + "\xff\xd9").find("scans") != std::string::npos);

  // Sizes of our own TIFF: entries of 12 bytes each, tag, type, count, value, low byte first.
  const auto tiff_bytes = encode_tiff(Image<float>(16, 16, 1.0f));
  const std::string tiff(reinterpret_cast<const char*>(tiff_bytes.data()), tiff_bytes.size());
  const auto value_of_tag = [&](const char* tag) {
    const std::size_t entry = tiff.find(std::string(tag, 2), static_cast<unsigned char>(tiff[4]));
    REQUIRE(entry != std::string::npos);
    return entry;
  };
  const std::string huge = altered(tiff, value_of_tag("\x01\x01") + 2, {4, 0, 1, 0, 0, 0, 0, 0, 8, 0});
  CHECK(complaint("a.tif", huge).find("524288 x 16") != std::string::npos);
  // A strip of half a million rows beside a picture of 16: what is decoded at once counts.
  const std::string strip = altered(tiff, value_of_tag("\x16\x01") + 2, {4, 0, 1, 0, 0, 0, 0, 0, 8, 0});
  CHECK(complaint("a.tif", strip).find("33554432 bytes") != std::string::npos);
}

TEST_CASE("formats that nobody promised are not handed to a decoder") {
  const ScratchFolder folder;
  for (const char* name : {"a.bmp", "a.pgm", "a.pfm"}) {
    cv::imwrite((folder / name).string(), cv::Mat(4, 5, std::string(name) == "a.pfm" ? CV_32FC1 : CV_8UC1, cv::Scalar(7)));
    CHECK(error_of(folder / name).find("expected a TIFF, PNG or JPEG image") != std::string::npos);
  }
}

TEST_CASE("what is no image, or an image without meaning, is refused by name") {
  const ScratchFolder folder;
  CHECK(error_of(folder / "absent.tif").find("absent.tif") != std::string::npos);
  CHECK(error_of(folder.path()).find("folder") != std::string::npos);
  write_text(folder / "empty.tif", "");
  CHECK(error_of(folder / "empty.tif").find("empty") != std::string::npos);
  write_text(folder / "text.png", "not an image");
  CHECK(error_of(folder / "text.png").find("damaged") != std::string::npos);

  const auto bytes = encode_tiff(Image<float>(50, 50, 1.0f));
  write_bytes(folder / "cut.tif", {bytes.begin(), bytes.begin() + 4000});
  CHECK_FALSE(error_of(folder / "cut.tif").empty());

  cv::imwrite((folder / "red.png").string(), cv::Mat(4, 5, CV_8UC3, cv::Scalar(0, 0, 255)));
  CHECK(error_of(folder / "red.png").find("colour") != std::string::npos);
  cv::imwrite((folder / "clear.png").string(), cv::Mat(4, 5, CV_8UC4, cv::Scalar(1, 1, 1, 0)));
  CHECK(error_of(folder / "clear.png").find("alpha") != std::string::npos);

  Image<float> image(3, 4, 1.0f);
  image(2, 1) = std::numeric_limits<float>::quiet_NaN();
  write_bytes(folder / "nan.tif", encode_tiff(image));
  CHECK(error_of(folder / "nan.tif").find("row 2, column 1") != std::string::npos);
  CHECK_THROWS_AS(encode_tiff(Image<float>()), UsageError);
}

namespace {

/// What is written to file descriptor 2 meanwhile, by whichever library.
template <class Work>
std::string printed_by(const std::filesystem::path& file, const Work& work) {
  const int saved = ::dup(STDERR_FILENO), fd = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  ::dup2(fd, STDERR_FILENO);
  ::close(fd);
  work();
  ::dup2(saved, STDERR_FILENO);
  ::close(saved);
  return read_text(file);
}

}  // namespace

TEST_CASE("damaged files are told in our words alone: decoders print nothing, and stderr works afterwards") {
  const ScratchFolder folder;
  cv::Mat noise(64, 64, CV_8UC1);
  std::mt19937 random(3);
  for (int n = 0; n < 64 * 64; ++n) noise.at<std::uint8_t>(n / 64, n % 64) = static_cast<std::uint8_t>(random());
  for (const char* ending : {".png", ".jpg", ".tif"}) {
    std::vector<unsigned char> whole;
    REQUIRE(cv::imencode(ending, noise, whole));
    const auto read = [&](const std::vector<unsigned char>& bytes) {
      try {
        (void)decode_image(std::as_bytes(std::span(bytes)), "file");
      } catch (const InputError&) {
      }
    };
    for (std::size_t cut = 40; cut < whole.size(); cut += whole.size() / 20) {
      std::vector<unsigned char> damaged = whole;
      for (std::size_t n = cut; n < std::min(cut + 20, damaged.size()); ++n) damaged[n] ^= 0x5a;
      INFO(ending << " damaged at byte " << cut);
      CHECK(printed_by(folder / "printed", [&] { read(damaged); }).empty());
      damaged.resize(cut);
      CHECK(printed_by(folder / "printed", [&] { read(damaged); }).empty());
    }
    CHECK(printed_by(folder / "printed", [&] {
            read(whole);
            (void)!::write(STDERR_FILENO, "ours", 4);
          }) == "ours");
  }
}

TEST_CASE("the size of an image is read without its pixels") {
  const ScratchFolder folder;
  write_bytes(folder / "a.tif", encode_tiff(Image<float>(12, 300)));
  const ImageSize size = read_image_size(folder / "a.tif");
  CHECK(size.n_rows == 12);
  CHECK(size.n_columns == 300);
  CHECK(size.decoded_bytes >= 12 * 300 * 4);
  write_text(folder / "b.tif", "no image");
  CHECK_THROWS_AS(read_image_size(folder / "b.tif"), InputError);
}

TEST_CASE("a JPEG file that was cut is refused, wherever it was cut") {
  const cv::Mat picture(64, 64, CV_8UC1, cv::Scalar(90));
  std::vector<unsigned char> whole;
  REQUIRE(cv::imencode(".jpg", picture, whole));
  const ScratchFolder folder;
  const auto written = [&](std::size_t n) {
    write_text(folder / "a.jpg", {reinterpret_cast<const char*>(whole.data()), n});
    return folder / "a.jpg";
  };
  CHECK(read_image(written(whole.size())).n_azimuth() == 64);
  for (const std::size_t n : {whole.size() - 2, whole.size() - 20, whole.size() / 2})
    CHECK_THROWS_AS(read_image(written(n)), InputError);
}
