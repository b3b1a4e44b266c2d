// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/glm.hpp>

namespace sarnerf {

/// A walk along a straight line through cubes of cells whose size may change from step to step. Which
/// cube comes next is decided by integers, so that rounding can neither skip one nor stand still.
class CellWalk {
 public:
  /// Position in units of cells is start + s · step, with s the range offset (m).
  CellWalk() = default;
  CellWalk(const glm::dvec3& start, const glm::dvec3& step, double s) : start_(start), step_(step) {
    cell_ = whole_below(start_ + s * step_);
    for (int axis = 0; axis < 3; ++axis) {
      // A ray that runs along the faces of cells never leaves through them.
      if (step_[axis] == 0.0) step_[axis] = 1e-30;
      inverse_[axis] = 1.0 / step_[axis];
      forward_[axis] = step_[axis] > 0.0 ? 1 : 0;
    }
  }

  const glm::ivec3& cell() const { return cell_; }

  /// Leaves the cube of `side` cells (a power of two) that holds the present one; returns s there. Free of
  /// branches where it can be: which side comes next is as good as random.
  double leave(int side) {
    const glm::ivec3 low = cell_ & glm::ivec3(-side);
    const glm::dvec3 border(low + side * forward_);
    const glm::dvec3 exit = (border - start_) * inverse_;
    const bool x_before_y = exit.x < exit.y;
    const double first_two = x_before_y ? exit.x : exit.y;
    const bool z_first = exit.z < first_two;
    const int through = z_first ? 2 : x_before_y ? 0 : 1;
    const double s = z_first ? exit.z : first_two;
    if (side > 1) {
      cell_ = glm::clamp(whole_below(start_ + s * step_), low, low + (side - 1));
    }
    cell_[through] = low[through] + (forward_[through] != 0 ? side : -1);
    return s;
  }

 private:
  /// Floor without a call into the mathematical library, which the baseline instruction set would need.
  static glm::ivec3 whole_below(const glm::dvec3& at) {
    constexpr double kLift = 4294967296.0;  // more than any index
    const auto below = [](double v) {
      return static_cast<int>(static_cast<std::int64_t>(v + kLift) - static_cast<std::int64_t>(kLift));
    };
    return {below(at.x), below(at.y), below(at.z)};
  }

  glm::dvec3 start_, step_, inverse_;
  glm::ivec3 cell_, forward_;
};

}  // namespace sarnerf
