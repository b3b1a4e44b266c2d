// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace sarnerf {

/// Base class of all errors that this library throws on purpose. The message is one line: what was expected,
/// what was found, where, and what to do about it. Error itself is thrown for failures at run time (full disk).
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Contradicting or impossible options, output that is in the way, more memory than allowed.
class UsageError : public Error {
 public:
  using Error::Error;
};

/// A file that is missing, malformed or holds values without meaning.
class InputError : public Error {
 public:
  using Error::Error;
};

/// An acquisition or a scene that has no image (radar below the ground, incidence of 90°).
class GeometryError : public Error {
 public:
  using Error::Error;
};

/// A computation whose result is not finite.
class NumericsError : public Error {
 public:
  using Error::Error;
};

/// A saved state that cannot be continued.
class CheckpointError : public Error {
 public:
  using Error::Error;
};

/// The user asked to stop, and everything that was finished is safely on disk.
class Interrupted : public Error {
 public:
  Interrupted() : Error("interrupted") {}
  using Error::Error;  ///< message: what was finished and how to continue
};

}  // namespace sarnerf
