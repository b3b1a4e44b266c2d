// SPDX-License-Identifier: Apache-2.0
#include "exit_code.h"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>

#include "console.h"
#include "sarnerf/core/error.h"

namespace sarnerf::app {
namespace {

/// What a library throws where nobody can catch it, on a thread of its own or while it makes one, still ends
/// with one line and an exit code.
[[noreturn]] void end_unhandled() {
  const char* what = "no exception";
  try {
    if (std::exception_ptr current = std::current_exception()) std::rethrow_exception(current);
  } catch (const std::exception& e) {
    what = e.what();
    std::fprintf(stderr, "%s: error: %s; free memory, raise the limits of this process, or use fewer --threads\n",
                 program_invocation_short_name, visible(what).c_str());
    std::_Exit(kFailure);
  } catch (...) {
    what = "unknown exception";
  }
  std::fprintf(stderr, "%s: error: ended from within (%s): please report this\n", program_invocation_short_name, what);
  std::_Exit(kFailure);
}

}  // namespace

int run_program(Console& console, const std::function<void()>& body) {
  std::set_terminate(end_unhandled);
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
