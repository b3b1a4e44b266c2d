// SPDX-License-Identifier: Apache-2.0
#include "sarnerf/recognise/classifier.h"

#include <fstream>
#include <iterator>
#include <string>
#include <stdexcept>
#include <vector>

#include <torch/csrc/autograd/autograd.h>

#include "../nerf/torch_catch.h"
#include "networks.h"
#include "sarnerf/core/error.h"
#include "sarnerf/recognise/cell.h"
#include "scratch_folder.h"

using namespace sarnerf;

namespace {

constexpr int kSide = 104;

/// Chips of three classes in one-look speckle: a bar along the rows, one along the columns, and a square. Their gains differ a lot.
LabelledChips shapes(int n_each, std::uint64_t seed) {
  torch::manual_seed(seed);
  LabelledChips chips{torch::ones({3 * n_each, kSide, kSide}), torch::arange(3 * n_each, torch::kInt64).remainder(3)};
  for (std::int64_t n = 0; n < chips.size(); ++n) {
    const std::int64_t c = n % 3;
    torch::Tensor chip = chips.amplitude[n];
    const std::int64_t rows = c == 0 ? 36 : c == 1 ? 6 : 15, columns = c == 0 ? 6 : c == 1 ? 36 : 15;
    chip.narrow(0, (kSide - rows) / 2, rows).narrow(1, (kSide - columns) / 2, columns).fill_(10.0f);
    chip.mul_((-torch::rand_like(chip).clamp_min(1e-6).log()).sqrt() * (0.1 + 10.0 * torch::rand({1}).item<double>()));
  }
  return chips;
}

double accuracy(const torch::Tensor& scores, const torch::Tensor& label) {
  return scores.argmax(1).eq(label).to(torch::kFloat64).mean().item<double>();
}

std::int64_t n_parameters(torch::nn::Sequential net) {
  std::int64_t n = 0;
  for (const torch::Tensor& parameter : net->parameters()) n += parameter.numel();
  return n;
}

}  // namespace

TEST_CASE("the networks have the layers of their papers", "[recognise]") {
  CHECK(n_parameters(a_convnet(10)) == 303'498);
  // 25,557,032 for three channels and 1000 classes; two channels of 64 × 7 × 7 and 990 classes of 2049 less.
  CHECK(n_parameters(resnet50(10)) == 25'557'032 - 2 * 64 * 49 - 990 * 2049);
  const torch::NoGradGuard guard;
  CHECK(a_convnet(7)->forward(torch::rand({2, 1, 88, 88})).sizes() == torch::IntArrayRef({2, 7}));
  CHECK(resnet50(7)->forward(torch::rand({2, 1, 64, 64})).sizes() == torch::IntArrayRef({2, 7}));
}

TEST_CASE("A-ConvNet computes what convolutions, rectification and maxima, one behind the other, compute", "[recognise]") {
  torch::manual_seed(4);
  torch::nn::Sequential net = a_convnet(10);
  net->eval();  // dropout aside
  const torch::Tensor chips = torch::randn({3, 1, 88, 88});
  const std::vector<torch::Tensor> p = net->parameters();  // weight and bias of five convolutions
  REQUIRE(p.size() == 10);
  torch::Tensor expected = chips;
  for (std::size_t layer = 0; layer < 5; ++layer) {
    expected = torch::conv2d(expected, p[2 * layer], p[2 * layer + 1]);
    if (layer < 4) expected = torch::relu(expected);
    if (layer < 3) expected = torch::max_pool2d(expected, 2);
  }
  expected = expected.flatten(1);
  const torch::Tensor found = net->forward(chips);
  CHECK(torch::allclose(found, expected, 1e-4, 1e-5));

  const torch::Tensor label = torch::tensor({1, 7, 2}, torch::kInt64);
  const auto gradients = [&](const torch::Tensor& scores) { return torch::autograd::grad({torch::cross_entropy_loss(scores, label)}, p); };
  const auto a = gradients(found), b = gradients(expected);
  for (std::size_t n = 0; n < p.size(); ++n) CHECK((a[n] - b[n]).norm().item<double>() <= 1e-4 * b[n].norm().item<double>());
}

TEST_CASE("normalised crops do not depend on a chip's gain", "[recognise]") {
  const torch::Tensor chips = shapes(2, 1).amplitude;
  const torch::Tensor crops = normalised_crops(chips, 88, 3, -8);
  CHECK(crops.sizes() == torch::IntArrayRef({6, 88, 88}));
  CHECK(crops.mean({1, 2}).abs().max().item<double>() < 1e-5);
  CHECK((crops.square().mean({1, 2}) - 1.0).abs().max().item<double>() < 1e-4);
  CHECK((normalised_crops(chips * 1e-3, 88, 3, -8) - crops).abs().max().item<double>() < 1e-3);
  CHECK(normalised_crops(torch::zeros({1, 88, 88}), 88).abs().max().item<double>() == 0.0);
  // A crop that is moved by three rows is that of the chip without its first six.
  CHECK(torch::equal(normalised_crops(chips, 88, 3, 0), normalised_crops(chips.narrow(1, 6, kSide - 6), 88)));
  CHECK_THROWS_AS(normalised_crops(chips, 88, 9, 0), std::invalid_argument);
}

TEST_CASE("classifiers learn shapes in speckle, whatever the gain", "[recognise]") {
  const TrainingChips training{shapes(6, 2), {}};
  const LabelledChips test = shapes(20, 3);
  ClassifierOptions o;
  o.n_steps = 40;
  o.batch = 16;
  int n_reports = 0;
  const torch::Tensor scores =
      classify(Classifier::a_convnet, training, test.amplitude, 3, o, [&](int, int total) { n_reports += total == 40; });
  CHECK(n_reports == 40);
  CHECK(accuracy(scores, test.label) > 0.9);
  CHECK((scores.exp().sum(1) - 1.0).abs().max().item<double>() < 1e-4);
  CHECK(accuracy(classify(Classifier::nearest_neighbour, training, test.amplitude, 3, o), test.label) > 0.9);
  SECTION("the same seed gives the same scores, another seed others") {
    CHECK(torch::equal(classify(Classifier::a_convnet, training, test.amplitude, 3, o), scores));
    o.seed = 2;
    CHECK(!torch::equal(classify(Classifier::a_convnet, training, test.amplitude, 3, o), scores));
  }
}

TEST_CASE("generated chips are learned from: here the shots of one class are missing", "[recognise]") {
  const LabelledChips all = shapes(12, 4), test = shapes(20, 5);
  TrainingChips training;
  const torch::Tensor first = torch::nonzero(all.label < 2).flatten(), rest = torch::nonzero(all.label == 2).flatten();
  training.shots = {all.amplitude.index_select(0, first), all.label.index_select(0, first)};
  training.generated = {all.amplitude.index_select(0, rest), all.label.index_select(0, rest)};
  ClassifierOptions o;
  o.n_steps = 40;
  o.batch = 16;
  CHECK(accuracy(classify(Classifier::a_convnet, training, test.amplitude, 3, o), test.label) > 0.9);
  o.shot_fraction = 1.0;
  CHECK(accuracy(classify(Classifier::a_convnet, training, test.amplitude, 3, o), test.label) < 0.7);
  // Classes without generated chips have shots in their place: without these, nothing but generated chips would be of one class.
  o.shot_fraction = 0.0;
  CHECK(accuracy(classify(Classifier::a_convnet, training, test.amplitude, 3, o), test.label) > 0.9);
}

TEST_CASE("a draw's file keeps everything that classifiers learn from", "[recognise]") {
  const ScratchFolder folder;
  DrawFile draw{{"a", "b", "c"}, 4, 7, {}, shapes(1, 8), {shapes(2, 9), shapes(1, 10), shapes(1, 12)}, {{"learned", {shapes(3, 11), "of learned"}}, {"none", {{}, "of none"}}}};
  draw.options = {11, 12, 0.13, 0.14, 0.15, 6, 0.17, 0.18, 19, torch::kCPU};
  write_draw_file((folder / "draw.pt").string(), draw);
  const DrawFile read = read_draw_file((folder / "draw.pt").string());
  CHECK(read.classes == draw.classes);
  CHECK((read.n_shots == 4 && read.draw == 7));
  const ClassifierOptions& o = read.options;
  CHECK((o.n_steps == 11 && o.batch == 12 && o.rate == 0.13 && o.weight_decay == 0.14 && o.label_smoothing == 0.15));
  CHECK((o.shift_pixels == 6 && o.gain_jitter == 0.17 && o.shot_fraction == 0.18 && o.seed == 19));
  const auto same = [](const LabelledChips& a, const LabelledChips& b) {
    return a.size() == b.size() && (a.size() == 0 || (torch::equal(a.amplitude, b.amplitude) && torch::equal(a.label, b.label)));
  };
  CHECK(same(read.shots, draw.shots));
  CHECK(same(read.test.measured, draw.test.measured));
  CHECK(same(read.test.within, draw.test.within));
  CHECK(same(read.test.across, draw.test.across));
  REQUIRE(read.generated.size() == 2);
  CHECK(same(read.generated.at("learned").chips, draw.generated.at("learned").chips));
  CHECK(same(read.generated.at("none").chips, draw.generated.at("none").chips));
  CHECK(read.generated.at("learned").study == "of learned");
  CHECK(read.generated.at("none").study == "of none");
  // A test chip of a class that the file does not have.
  draw.classes.pop_back();
  write_draw_file((folder / "damaged.pt").string(), draw);
  CHECK_THROWS_AS(read_draw_file((folder / "damaged.pt").string()), InputError);
}

TEST_CASE("a draw's file of which a bit has changed is refused", "[recognise]") {
  const ScratchFolder folder;
  const std::string path = (folder / "draw.pt").string();
  write_draw_file(path, {{"a", "b", "c"}, 4, 7, {}, shapes(1, 8), {shapes(2, 9), {}, {}}, {{"none", {{}, "of none"}}}});
  const LabelledChips whole = read_draw_file(path).test.measured;
  std::string bytes;
  {
    std::ifstream in(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(in), {});
  }
  // A mantissa of a test chip: its value stays finite.
  const float* first = whole.amplitude.data_ptr<float>();
  const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(first), 64));
  REQUIRE(at != std::string::npos);
  bytes[at] = static_cast<char>(bytes[at] ^ 1);
  std::ofstream(path, std::ios::binary) << bytes;
  CHECK_THROWS_WITH(read_draw_file(path), ContainsSubstring("is damaged"));
}

TEST_CASE("a cell has the answers on all test chips, and names its device", "[recognise]") {
  const LabelledChips training = shapes(4, 12), test = shapes(6, 13);
  Cell cell{Classifier::nearest_neighbour, "none", 4, 0, "mark", {}, {}, {}, {}, 0.0};
  ClassifierOptions o;
  o.device = torch::kMeta;  // of networks alone
  make_cell(cell, {training, {}}, {test, test, {}}, 3, o);
  CHECK(accuracy(cell.confusion) > 0.9);
  CHECK(cell.within == cell.confusion);
  CHECK(cell.across.empty());
  // Each part has its own answers: here the chips of other classes, and half as many.
  const LabelledChips fewer = shapes(3, 14), others{fewer.amplitude, (fewer.label + 1).remainder(3)};
  make_cell(cell, {training, {}}, {test, others, fewer}, 3, o);
  CHECK(accuracy(cell.confusion) > 0.9);
  CHECK(accuracy(cell.within) < 0.1);
  CHECK(accuracy(cell.across) > 0.9);
  CHECK(cell.across[0][0] + cell.across[0][1] + cell.across[0][2] == 3);
  CHECK(cell.device.starts_with("cpu, "));
  CHECK((has_cell(Classifier::background, "none") && !has_cell(Classifier::background, "turned")));
  CHECK((is_network(Classifier::resnet50) && !is_network(Classifier::nearest_neighbour)));
}

TEST_CASE("the background tells classes apart only if their clutter differs", "[recognise]") {
  const LabelledChips training = shapes(40, 6), test = shapes(40, 7);
  const ClassifierOptions o;
  CHECK(accuracy(classify(Classifier::background, {training, {}}, test.amplitude, 3, o), test.label) < 0.5);
  const auto with_smooth_clutter = [](LabelledChips chips) {
    for (std::int64_t n = 0; n < chips.size(); n += 3) chips.amplitude[n].narrow(0, 0, 40).fill_(chips.amplitude[n].mean().item<float>());
    return chips;
  };
  const torch::Tensor scores = classify(Classifier::background, {with_smooth_clutter(training), {}},
                                        with_smooth_clutter(test).amplitude, 3, o);
  CHECK(scores.argmax(1).eq(0).eq(test.label.eq(0)).to(torch::kFloat64).mean().item<double>() > 0.95);
}

TEST_CASE("patches of speckle are told apart by their response, and not if there is no difference", "[recognise]") {
  torch::manual_seed(15);
  const auto patches = [](int n, int width) {  // amplitude of one-look speckle; power is averaged over so many pixels, as a wider response does
    const torch::Tensor power = torch::rand({n, 1, 23 + width, 23 + width}).clamp_min(1e-6).log().neg();
    return torch::avg_pool2d(power, width, 1).squeeze(1).sqrt();
  };
  const auto kinds = [&](int n, int width) {
    return LabelledChips{torch::cat({patches(n, 1), patches(n, width)}), torch::cat({torch::zeros({n}, torch::kInt64), torch::ones({n}, torch::kInt64)})};
  };
  ClassifierOptions o;
  o.n_steps = 60;
  o.batch = 32;
  o.rate = 4e-3;
  o.shift_pixels = 0;
  const auto correct = [&](int width) {
    const LabelledChips test = kinds(100, width);
    return accuracy(classify(Classifier::texture, {kinds(100, width), {}}, test.amplitude, 2, o), test.label);
  };
  CHECK(correct(2) > 0.9);
  CHECK(correct(1) == Approx(0.5).margin(0.12));  // 200 patches: a standard deviation of 0.035
}

TEST_CASE("ResNet-50 is trained like the other networks, and a network that diverges is an error", "[recognise]") {
  const TrainingChips training{shapes(2, 16), {}};
  ClassifierOptions o;
  o.n_steps = 2;
  o.batch = 4;
  CHECK(classify(Classifier::resnet50, training, shapes(1, 17).amplitude, 3, o).sizes() == torch::IntArrayRef({3, 3}));
  o.rate = 1e30;
  CHECK_THROWS_AS(classify(Classifier::a_convnet, training, training.shots.amplitude, 3, o), NumericsError);
}

TEST_CASE("chips that are too small, and labels without a class, are refused", "[recognise]") {
  const LabelledChips chips = shapes(2, 8);
  const ClassifierOptions o;
  CHECK_THROWS_AS(classify(Classifier::a_convnet, {chips, {}}, chips.amplitude, 2, o), std::invalid_argument);
  CHECK_THROWS_AS(classify(Classifier::a_convnet, {{chips.amplitude.narrow(1, 0, 90), chips.label}, {}}, chips.amplitude, 3, o),
                  std::invalid_argument);
}

TEST_CASE("corners of chips lie at their edges, in the order of rows", "[recognise]") {
  const torch::Tensor chips = torch::arange(2 * 5 * 6, torch::kFloat32).view({2, 5, 6});
  const auto corners = corners_of(chips, 2);
  const std::int64_t rows[] = {0, 0, 3, 3}, columns[] = {0, 4, 0, 4};
  for (std::size_t k = 0; k < 4; ++k) {
    REQUIRE(corners[k].sizes() == torch::IntArrayRef({2, 2, 2}));
    CHECK(corners[k][1][1][0].item<float>() == chips[1][rows[k] + 1][columns[k]].item<float>());
  }
}
