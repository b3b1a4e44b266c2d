// SPDX-License-Identifier: Apache-2.0
#include "app_main.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <string>

#include <unistd.h>

#include "console.h"
#include "sarnerf/core/error.h"

namespace sarnerf::app {

namespace {

/// Terminate handler: reports an exception that no caller can catch (thrown on a library's own thread, or while the
/// library starts one) in one line and ends the process with an exit code.
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
  std::fprintf(stderr, "%s: error: internal error (%s): please report this\n", program_invocation_short_name, what);
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
    // what() names a function of the library; users need the path and the system's reason.
    const std::string path = e.path1().empty() ? "" : e.path1().string() + ": ";
    return fail((path + e.code().message()).c_str(), kFailure);
  } catch (const Error& e) {
    return fail(e.what(), kFailure);
  } catch (const std::exception& e) {
    // A library's. LibTorch's goes on with a trace of its code, many lines long.
    const std::string what = e.what();
    return fail(what.substr(0, what.find('\n')).c_str(), kFailure);
  }
}

namespace {

// A signal handler can reach nothing but globals.
std::atomic<bool> stop = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler needs a lock-free flag");

void on_signal(int) {
  if (stop.exchange(true)) _exit(kInterrupted);
}

}  // namespace

const std::atomic<bool>& stop_requested() { return stop; }

void catch_signals() {
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  std::signal(SIGXFSZ, SIG_IGN);
}

void take_threads(SharedOptions& options, Console& console) {
  const int asked = options.n_threads, n = thread_count();
  options.n_threads = n;
  if (n == asked) return;
  console.warning(std::to_string(asked) + " threads cannot be used here: " +
                  std::to_string(n) + " will work (--threads)");
}

}  // namespace sarnerf::app
