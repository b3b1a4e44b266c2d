// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/dataset/image_index.h"

#include "catch.h"
#include "sarnerf/core/error.h"
#include "scratch_folder.h"

using namespace sarnerf;

namespace {

/// Empty files stand for images: an index does not read them.
class ImageFolder : public ScratchFolder {
 public:
  ImageFolder() {
    std::filesystem::create_directories(*this / "images/deeper");
    for (const char* name :
         {"images/a.png", "images/b, c.tif", "images/deeper/d.JPEG", "images/notes.txt", "e.png"})
      write_text(*this / name, "");
  }
  std::vector<IndexedImage> index(const std::string& table) const {
    write_text(*this / "table.csv", table);
    return read_image_index(*this / "table.csv", *this / "images");
  }
  std::string refusal(const std::string& table) const {
    try {
      index(table);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  }
};

bool contains(const std::string& text, const char* piece) {
  INFO(text);
  CHECK(text.find(piece) != std::string::npos);
  return text.find(piece) != std::string::npos;
}

}  // namespace

TEST_CASE("a table says how images were taken") {
  const ImageFolder folder;
  const auto images = folder.index(
      "\xef\xbb\xbf"
      "file,class,serial,azimuth_deg,depression_deg,range_spacing_m,azimuth_spacing_m,slant_range_"
      "m,"
      "split,kind\r\n"
      "images/a.png,2S1,b01,0.22484,15,0.202,0.203,4475,train,x\r\n"
      "\"b, c.tif\",\"the \"\"other\"\" one\",,10.5,,,,,,\n"
      "images/deeper/d.JPEG,,,1e1,17.5,,,,,\n"
      "e.png,,,1,17,,,,,\n");
  REQUIRE(images.size() == 3);  // e.png lies elsewhere
  CHECK(images[0].file.filename() == "a.png");
  CHECK(images[0].azimuth_deg == 0.22484);
  CHECK(images[0].depression_deg == 15.0);
  CHECK(images[0].slant_range_m == 4475.0);
  CHECK(images[0].azimuth_spacing_m == 0.203);
  CHECK(images[0].range_spacing_m == 0.202);
  CHECK(images[0].class_name == "2S1");
  CHECK(images[0].serial == "b01");
  CHECK(images[0].split == "train");
  // Beside the table there is no such file; in the folder there is.
  CHECK(images[1].file.filename() == "b, c.tif");
  CHECK(images[1].class_name == "the \"other\" one");
  CHECK_FALSE(images[1].depression_deg);
  CHECK_FALSE(images[1].slant_range_m);
  CHECK(images[2].azimuth_deg == 10.0);

  const auto incidences = folder.index("file,azimuth_deg,incidence_deg\nimages/a.png,3,73\n");
  CHECK(incidences.at(0).depression_deg == 17.0);
}

TEST_CASE("a field that is written for a table is read back") {
  CHECK(csv_field("2S1") == "2S1");
  CHECK(csv_field("") == "");
  const ImageFolder folder;
  const std::string name = "T-72, the \"A64\"";
  const auto images = folder.index("file,class,azimuth_deg\nimages/a.png," + csv_field(name) + ",3\n");
  CHECK(images.at(0).class_name == name);
}

TEST_CASE("tables that contradict the folder or themselves are refused") {
  const ImageFolder folder;
  contains(folder.refusal(""), "the table is empty");
  contains(folder.refusal("azimuth_deg\n1\n"), "no column file");
  contains(folder.refusal("file\na.png\n"), "no column azimuth_deg");
  contains(folder.refusal("file,azimuth_deg,file\na.png,1,b\n"), "the column 'file' is listed twice");
  contains(folder.refusal("file,azimuth_deg\na.png\n"), "row 1: expected 2 fields");
  contains(folder.refusal("file,azimuth_deg\na.png,1\n\"b, c.tif,2\n"), "a quote does not close");
  contains(folder.refusal("file,azimuth_deg\na.png,east\n"),
           "row 1: azimuth_deg: expected a number, found 'east'");
  contains(folder.refusal("file,azimuth_deg\na.png,inf\n"), "expected a number");
  contains(folder.refusal("file,azimuth_deg\na.png,\n"), "azimuth_deg is empty");
  contains(folder.refusal("file,azimuth_deg,depression_deg\na.png,1,90\n"), "between 0 and 90");
  contains(folder.refusal("file,azimuth_deg,depression_deg,incidence_deg\na.png,1,17,17\n"),
           "contradict each other");
  contains(folder.refusal("file,azimuth_deg,slant_range_m\na.png,1,-5\n"),
           "slant_range_m: expected a number above 0");
  contains(folder.refusal("file,azimuth_deg\na.png,1\nimages/a.png,2\n"),
           "row 2: the image 'images/a.png' is listed twice");
  const std::string unknown = folder.refusal("file,azimuth_deg\na.png,1\nno.png,2\nnone.png,3\n");
  contains(unknown, "2 of 3 files exist neither");
  contains(unknown, "no.png, none.png");
  contains(folder.refusal("file,azimuth_deg\n,1\n"), "expected the name of an image");
}

TEST_CASE("names carry azimuths") {
  const ScratchFolder folder;
  for (const char* name : {"50.2248_HB15087.tif", "0_a.png", "359.9_b_c.jpg", "notes.txt"})
    write_text(folder / name, "");
  const auto images = index_by_names(folder.path());
  REQUIRE(images.size() == 3);
  CHECK(images[0].azimuth_deg == 0.0);
  CHECK(images[1].azimuth_deg == 359.9);
  CHECK(images[2].azimuth_deg == 50.2248);
  CHECK(images[2].file.filename() == "50.2248_HB15087.tif");

  // What an earlier import left in the folder is no image of it.
  std::filesystem::create_directories(folder / "out/images");
  write_text(folder / "out/dataset.json", "{}");
  write_text(folder / "out/images/view_000.tif", "");
  CHECK(index_by_names(folder.path()).size() == 3);

  for (const char* name : {"HB15087.tif", "50.2248.tif", "nan_a.tif", "_a.tif"})
    write_text(folder / name, "");
  try {
    index_by_names(folder.path());
    FAIL("accepted names without azimuth");
  } catch (const InputError& e) {
    contains(e.what(), "no azimuth in the names of 4 images");
    contains(e.what(), "HB15087.tif");
  }
  CHECK_THROWS_AS(index_by_names(folder / "missing"), InputError);
}
