// SPDX-License-Identifier: Apache-2.0
#include "exit_code.h"

#include <exception>
#include <filesystem>
#include <new>

#include "console.h"
#include "sarnerf/core/error.h"

namespace sarnerf::app {

int run_program(Console& console, const std::function<void()>& body) {
  const auto fail = [&](const char* message, ExitCode code) {
    console.error(message);
    return code;
  };
  try {
    body();
    return kDone;
  } catch (const UsageError& e) {
    return fail(e.what(), kUsage);
  } catch (const GeometryError& e) {
    return fail(e.what(), kUsage);
  } catch (const InputError& e) {
    return fail(e.what(), kBadInput);
  } catch (const CheckpointError& e) {
    return fail(e.what(), kBadInput);
  } catch (const NumericsError& e) {
    return fail(e.what(), kNumerics);
  } catch (const Interrupted& e) {
    return fail(e.what(), kInterrupted);
  } catch (const std::bad_alloc&) {
    return fail("out of memory; make the image smaller, use fewer --threads, or set --max-memory to be "
                "told beforehand",
                kFailure);
  } catch (const std::filesystem::filesystem_error& e) {
    // The library's own text names its function; the path and the system's reason are what matters.
    const std::string path = e.path1().empty() ? "" : e.path1().string() + ": ";
    return fail((path + e.code().message()).c_str(), kFailure);
  } catch (const std::exception& e) {
    return fail(e.what(), kFailure);
  }
}

}  // namespace sarnerf::app
