// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/nerf/lpips.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "catch.h"
#include "lpips_weights.h"
#include "sarnerf/core/error.h"
#include "scratch_folder.h"

using namespace sarnerf;
using namespace sarnerf::test;

namespace {

/// Features of one image: channels, rows, columns.
struct Features {
  int n_channels, n_rows, n_columns;
  std::vector<double> values;

  Features(int channels, int rows, int columns)
      : n_channels(channels),
        n_rows(rows),
        n_columns(columns),
        values(static_cast<std::size_t>(channels * rows * columns)) {}
  double& at(int c, int i, int j) {
    return values[static_cast<std::size_t>((c * n_rows + i) * n_columns + j)];
  }
  double at(int c, int i, int j) const { return const_cast<Features*>(this)->at(c, i, j); }
};

/// A photograph's normalisation of power in [0, 1].
Features input(const Image<float>& power, double peak) {
  const double mean[] = {-0.030, -0.088, -0.188}, spread[] = {0.458, 0.448, 0.450};
  Features in(3, power.n_azimuth(), power.n_range());
  for (int c = 0; c < 3; ++c) {
    for (int i = 0; i < in.n_rows; ++i) {
      for (int j = 0; j < in.n_columns; ++j) {
        const double share = std::clamp(double(power(i, j)) / peak, 0.0, 1.0);
        in.at(c, i, j) = (2.0 * share - 1.0 - mean[c]) / spread[c];
      }
    }
  }
  return in;
}

Features convolved(const Features& in, const SmallNetwork& net, std::size_t l) {
  const int k = net.kKernel[l], stride = l == 0 ? 4 : 1, padding = l < 2 ? 2 : 1;
  Features out(net.channels[l + 1], (in.n_rows + 2 * padding - k) / stride + 1,
               (in.n_columns + 2 * padding - k) / stride + 1);
  for (int o = 0; o < out.n_channels; ++o) {
    for (int i = 0; i < out.n_rows; ++i) {
      for (int j = 0; j < out.n_columns; ++j) {
        double sum = double(net.bias[l][static_cast<std::size_t>(o)]);
        for (int c = 0; c < in.n_channels; ++c) {
          for (int a = 0; a < k; ++a) {
            for (int b = 0; b < k; ++b) {
              const int row = i * stride + a - padding, column = j * stride + b - padding;
              if (row < 0 || row >= in.n_rows || column < 0 || column >= in.n_columns) continue;
              const int place = ((o * in.n_channels + c) * k + a) * k + b;
              sum += double(net.weight[l][static_cast<std::size_t>(place)]) * in.at(c, row, column);
            }
          }
        }
        out.at(o, i, j) = std::max(0.0, sum);
      }
    }
  }
  return out;
}

Features pooled(const Features& in) {
  Features out(in.n_channels, (in.n_rows - 3) / 2 + 1, (in.n_columns - 3) / 2 + 1);
  for (int c = 0; c < out.n_channels; ++c) {
    for (int i = 0; i < out.n_rows; ++i) {
      for (int j = 0; j < out.n_columns; ++j) {
        double most = -std::numeric_limits<double>::infinity();
        for (int a = 0; a < 3; ++a) {
          for (int b = 0; b < 3; ++b) most = std::max(most, in.at(c, 2 * i + a, 2 * j + b));
        }
        out.at(c, i, j) = most;
      }
    }
  }
  return out;
}

double norm(const Features& f, int i, int j) {
  double sum = 0.0;
  for (int c = 0; c < f.n_channels; ++c) sum += f.at(c, i, j) * f.at(c, i, j);
  return std::sqrt(sum) + 1e-10;
}

/// The definition, in double.
double by_definition(const SmallNetwork& net, const Image<float>& x, const Image<float>& y,
                     double peak) {
  Features a = input(x, peak), b = input(y, peak);
  double total = 0.0;
  for (std::size_t l = 0; l < 5; ++l) {
    if (l == 1 || l == 2) {
      a = pooled(a);
      b = pooled(b);
    }
    a = convolved(a, net, l);
    b = convolved(b, net, l);
    double layer = 0.0;
    for (int i = 0; i < a.n_rows; ++i) {
      for (int j = 0; j < a.n_columns; ++j) {
        const double na = norm(a, i, j), nb = norm(b, i, j);
        for (int c = 0; c < a.n_channels; ++c) {
          const double d = a.at(c, i, j) / na - b.at(c, i, j) / nb;
          layer += double(net.linear[l][static_cast<std::size_t>(c)]) * d * d;
        }
      }
    }
    total += layer / (a.n_rows * a.n_columns);
  }
  return total;
}

Image<float> speckle(int n_azimuth, int n_range, unsigned seed) {
  std::mt19937 random(seed);
  std::exponential_distribution<float> power(1.0f);
  Image<float> image(n_azimuth, n_range);
  for (float& p : image.pixels()) p = power(random);
  return image;
}

class WeightsFile {
 public:
  explicit WeightsFile(const std::string& bytes) { write_text(path(), bytes); }
  std::filesystem::path path() const { return folder_ / "alex.safetensors"; }

 private:
  ScratchFolder folder_;
};

}  // namespace

TEST_CASE("LPIPS is what its definition says, in double") {
  for (const unsigned seed : {1u, 2u}) {
    const SmallNetwork net(seed);
    const Lpips lpips(WeightsFile(file_of(net)).path());
    const int sizes[][2] = {{31, 31}, {64, 47}, {38, 70}};
    for (const auto& [n_azimuth, n_range] : sizes) {
      CAPTURE(seed, n_azimuth, n_range);
      const Image<float> x = speckle(n_azimuth, n_range, 3), y = speckle(n_azimuth, n_range, 4);
      for (const double peak : {1.5, 8.0}) {  // with and without pixels beyond the peak
        const double expected = by_definition(net, x, y, peak);
        CHECK(expected > 0.01);
        CHECK(lpips(x, y, peak) == Approx(expected).epsilon(2e-5));
      }
    }
  }
}

TEST_CASE("LPIPS is a distance of images relative to the peak") {
  const Lpips lpips(WeightsFile(file_of(SmallNetwork())).path());
  const Image<float> x = speckle(40, 40, 1), y = speckle(40, 40, 2);
  CHECK(lpips(x, x, 5.0) == 0.0);
  CHECK(lpips(x, y, 5.0) == Approx(lpips(y, x, 5.0)).epsilon(1e-5));
  Image<float> x4 = x, y4 = y, above = x, nearly = x;
  for (float& p : x4.pixels()) p *= 4.0f;
  for (float& p : y4.pixels()) p *= 4.0f;
  CHECK(lpips(x4, y4, 20.0) == lpips(x, y, 5.0));
  for (std::size_t n = 0; n < x.pixels().size(); ++n) {
    if (x.pixels()[n] > 2.0f) above.pixels()[n] = 9.0f;
    nearly.pixels()[n] = 0.95f * x.pixels()[n] + 0.05f * y.pixels()[n];
  }
  CHECK(lpips(above, x, 2.0) == 0.0);  // all beyond the peak is white
  CHECK(lpips(nearly, x, 5.0) < lpips(y, x, 5.0));
  const Lpips copy = lpips;
  CHECK(copy(x, y, 5.0) == lpips(x, y, 5.0));
}

TEST_CASE("LPIPS refuses images that the network cannot see") {
  const Lpips lpips(WeightsFile(file_of(SmallNetwork())).path());
  CHECK_THROWS_AS(lpips(speckle(40, 40, 1), speckle(40, 41, 1), 1.0), UsageError);
  CHECK_THROWS_AS(lpips(speckle(30, 40, 1), speckle(30, 40, 1), 1.0), UsageError);
  CHECK_THROWS_AS(lpips(speckle(40, 40, 1), speckle(40, 40, 1), 0.0), UsageError);
  Image<float> bad = speckle(40, 40, 1);
  bad(3, 3) = std::numeric_limits<float>::quiet_NaN();
  CHECK_THROWS_AS(lpips(bad, speckle(40, 40, 1), 1.0), NumericsError);
}

TEST_CASE("weights that are not AlexNet's LPIPS are refused in one line that names the place") {
  const auto message = [](const std::string& bytes) -> std::string {
    const WeightsFile file(bytes);
    try {
      const Lpips lpips(file.path());
    } catch (const InputError& e) {
      CHECK(std::string(e.what()).find('\n') == std::string::npos);
      return e.what();
    }
    return "accepted";
  };
  const auto holds = [&](const std::string& bytes, const std::string& part) {
    const std::string text = message(bytes);
    CAPTURE(text, part);
    return text.find(part) != std::string::npos;
  };
  const auto changed = [](const char* from, const char* to) {
    std::string bytes = file_of(SmallNetwork());
    const auto at = bytes.find(from);
    if (at == std::string::npos)
      throw std::runtime_error(std::string("the file does not hold ") + from);
    return bytes.replace(at, std::string(from).size(), to);
  };
  const std::string good = file_of(SmallNetwork());
  REQUIRE(message(good) == "accepted");

  CHECK_THROWS_AS(Lpips("no/such/file.safetensors"), InputError);
  CHECK(holds("", "only 0 bytes"));
  CHECK(holds("PK\x03\x04 a pickled archive, not what is wanted", "its header should be"));
  CHECK(holds(std::string("\x07\0\0\0\0\0\0\0[1,2,3]", 15), "not a JSON object"));
  CHECK(holds(good.substr(0, 700), "its header should be"));
  CHECK(holds(good.substr(0, good.size() - 4),
              "lin4.model.1.weight: its values should lie at bytes"));
  CHECK(holds(changed("features.6.bias", "features.7.bias"), "\"features.6.bias\" is missing"));
  CHECK(holds(changed("\"F32\",\"shape\":[6,4,5,5]", "\"F16\",\"shape\":[6,4,5,5]"),
              "features.3.weight: expected values of type F32, found \"F16\""));
  CHECK(holds(changed("[6,4,5,5]", "[6,4,5,4]"), "features.3.weight: its shape does not fit"));
  CHECK(holds(changed("[6,4,5,5]", "[4,6,5,5]"),
              "features.3.weight: expected the shape [4, 4, 5, 5]"));
  CHECK(holds(changed("[1,5,1,1]", "[5,1,1,1]"),
              "lin2.model.1.weight: expected the shape [1, 5, 1, 1]"));
  CHECK(holds(changed("[6,4,5,5]", "[-6,4,5] "), "not a list of whole numbers"));
  CHECK(holds(changed("[4,3,11,11]", "[1e9,1,1,1]"), "not a list of whole numbers"));

  SmallNetwork net;
  net.bias[3][1] = std::numeric_limits<float>::infinity();
  CHECK(holds(file_of(net), "features.8.bias: holds values that are not finite"));
}

TEST_CASE("damaged weights are read or refused, nothing else") {
  const std::string good = file_of(SmallNetwork());
  const std::size_t header = good.find("}  ") + 3;
  std::mt19937 random(7);
  int n_refused = 0;
  for (int n = 0; n < 400; ++n) {
    std::string bytes = good;
    for (int flips = 1 + n % 3; flips > 0; --flips) {
      bytes[random() % header] = static_cast<char>(random() & 0xff);
    }
    if (n % 10 == 0) bytes.resize(random() % bytes.size());
    const WeightsFile file(bytes);
    try {
      const Lpips lpips(file.path());
    } catch (const InputError&) {
      ++n_refused;
    }
  }
  CHECK(n_refused > 200);
}
