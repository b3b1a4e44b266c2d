// SPDX-License-Identifier: Apache-2.0
#include "contestant.h"

#include "plain_learner.h"
#include "sarnerf/core/parallel.h"
#include "sarnerf/nerf/trainer.h"
#include "torch_setup.h"

namespace sarnerf::bench {
namespace {

class TrainedField : public Contestant {
 public:
  TrainedField(TrainingSet set, const TrainerOptions& options) : trainer_(std::move(set), options) {}

  void step(double progress) override { trainer_.step(progress); }
  Image<float> render(const Acquisition& acquisition) const override {
    return render_view(trainer_.field(), acquisition);
  }

 private:
  Trainer trainer_;
};

}  // namespace

std::unique_ptr<Contestant> make_contestant(const std::string& field, TrainingSet set,
                                            std::uint64_t seed) {
  app::use_torch_threads(field == "grid" ? 1 : thread_count());
  if (field == "plain") {
    PlainOptions options;
    options.seed = seed;
    return std::make_unique<PlainLearner>(std::move(set), options);
  }
  TrainerOptions options = default_options(set, field, Schedule::clock);
  options.seed = seed;
  return std::make_unique<TrainedField>(std::move(set), options);
}

}  // namespace sarnerf::bench
