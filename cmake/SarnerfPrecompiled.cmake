# Precompiled headers, shared by targets whose units have the same flags. LibTorch's take 8 s of processor time to parse,
# OpenVDB's 5, nlohmann's and the standard library's 3: without this, that is most of the build. Each kind is parsed once.
#
# Reading them is not free: GCC instantiates what their inline functions ask for in every unit anew, 3 s for LibTorch's, 2 s for
# OpenVDB's, 1 s for the base. Units of a target that include none of them go without (sarnerf_light_sources).
#
# A unit still names what it includes: tests/hygiene compiles every public header by itself, without any of these.
set(sarnerf_precompiled_base
  <algorithm> <array> <atomic> <chrono> <cmath> <cstddef> <cstdint> <cstring> <exception> <filesystem> <fstream>
  <functional> <iterator> <limits> <map> <memory> <mutex> <numeric> <optional> <random> <set> <span> <sstream> <string>
  <string_view> <system_error> <thread> <tuple> <unordered_map> <utility> <variant> <vector>
  <glm/glm.hpp> ${PROJECT_SOURCE_DIR}/src/core/json_view.h)
set(sarnerf_precompiled_openvdb ${sarnerf_precompiled_base} <openvdb/openvdb.h>)
set(sarnerf_precompiled_torch ${sarnerf_precompiled_base} <torch/types.h> <torch/csrc/autograd/custom_function.h>)
set(sarnerf_precompiled_test ${sarnerf_precompiled_base} ${PROJECT_SOURCE_DIR}/tests/catch.h)
set(sarnerf_precompiled_torch_test ${sarnerf_precompiled_torch} ${PROJECT_SOURCE_DIR}/tests/nerf/torch_catch.h)
set(sarnerf_precompiled_program ${sarnerf_precompiled_base})
set(sarnerf_precompiled_torch_program ${sarnerf_precompiled_torch})
set(sarnerf_packages_base glm::glm nlohmann_json::nlohmann_json)
set(sarnerf_packages_openvdb ${sarnerf_packages_base} sarnerf_openvdb)
set(sarnerf_packages_torch ${sarnerf_packages_base} sarnerf_torch)
set(sarnerf_packages_program ${sarnerf_packages_base})
set(sarnerf_packages_torch_program ${sarnerf_packages_torch})
set(sarnerf_packages_test ${sarnerf_packages_base} Catch2::Catch2)
set(sarnerf_packages_torch_test ${sarnerf_packages_torch} Catch2::Catch2)

# Little time is spent in the own code of programs and of tests: with -O1 a unit of a program compiles in two thirds of the time,
# with -O0 one of a test in half of it. GCC 12 crashes on precompiled headers of another level, so that all targets of a kind have
# the same. sar_bench, which measures, is of none of these kinds.
set(sarnerf_options_program $<$<CONFIG:Release>:-O1>)
set(sarnerf_options_torch_program ${sarnerf_options_program})
set(sarnerf_options_test $<$<CONFIG:Release>:-O0>)
set(sarnerf_options_torch_test ${sarnerf_options_test})

# sarnerf_few_units(target): compiles up to eight of the target's sources as one, because most of the time goes into headers, which
# are read, and instantiated, once then. Names in the unnamed namespaces of its sources must differ.
function(sarnerf_few_units target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
endfunction()

# sarnerf_precompiled(target kind): kind is one of base, openvdb, torch, program, torch_program, test and torch_test. Programs and
# tests are compiled in few units.
function(sarnerf_precompiled target kind)
  if(SARNERF_FUZZ)
    return()  # its sanitizers have options for single libraries
  endif()
  target_compile_options(${target} PRIVATE ${sarnerf_options_${kind}})
  if(kind MATCHES "(program|test)$")
    sarnerf_few_units(${target})
  endif()
  # GCC takes precompiled headers of -fPIC for units of -fPIC alone, so that programs are compiled as libraries are.
  get_target_property(type ${target} TYPE)
  if(type STREQUAL "EXECUTABLE")
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)
    target_compile_options(${target} PRIVATE -fPIC)
  endif()
  set(shared sarnerf_precompiled_${kind})
  if(NOT TARGET ${shared})
    set(unit ${PROJECT_BINARY_DIR}/precompiled/${shared}.cpp)
    file(CONFIGURE OUTPUT ${unit} CONTENT "")
    add_library(${shared} OBJECT ${unit})
    target_compile_features(${shared} PRIVATE cxx_std_20)
    # With -Wpedantic GCC defines fewer macros, so warnings must be the same, too.
    target_link_libraries(${shared} PRIVATE ${sarnerf_packages_${kind}} sarnerf_warnings)
    target_precompile_headers(${shared} PRIVATE ${sarnerf_precompiled_${kind}})
    target_compile_options(${shared} PRIVATE ${sarnerf_options_${kind}})
    if(kind MATCHES "test$")
      target_include_directories(${shared} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
    endif()
  endif()
  target_precompile_headers(${target} REUSE_FROM ${shared})
  # GCC 12 forgets, with precompiled headers, that std::string's own code is the system's, and warns of impossible sizes in
  # it. With CMAKE_DISABLE_PRECOMPILE_HEADERS it gives these warnings where they are true.
  if(NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
    target_compile_options(${target} PRIVATE
      $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-array-bounds>
      $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-stringop-overflow>
      $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-stringop-overread>)
  endif()
endfunction()

# sarnerf_source_options(source options...): a source whose flags differ from its target's can use no precompiled headers.
function(sarnerf_source_options source)
  set_source_files_properties(${source} PROPERTIES COMPILE_OPTIONS "${ARGN}" SKIP_PRECOMPILE_HEADERS ON)
endfunction()

# sarnerf_light_sources(source...): sources that include none of the libraries whose headers their target has precompiled.
function(sarnerf_light_sources)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
endfunction()
