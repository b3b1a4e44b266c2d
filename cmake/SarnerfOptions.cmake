# Compiler settings shared by every target, carried by two interface targets and by nothing global.
include(GNUInstallDirs)

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)

add_library(sarnerf_warnings INTERFACE)
target_compile_options(sarnerf_warnings INTERFACE
  -Wall -Wextra -Wpedantic  # the usual suspects
  -Wshadow                  # a shadowed index is a wrong index
  -Wconversion              # silent double-to-float loses metres at orbital range
  -Wno-sign-conversion      # sizes and the indices i, j, k meet everywhere; conversions there are harmless
  -Wnon-virtual-dtor -Woverloaded-virtual -Wcast-align -Wunused
  # GCC 12 reports impossible overlaps inside std::string's own code (its bug 105651, mended in 13).
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>)
option(SARNERF_WERROR "Treat warnings as errors" OFF)
if(SARNERF_WERROR)
  target_compile_options(sarnerf_warnings INTERFACE -Werror)
endif()

include(SarnerfPrecompiled)

# sarnerf_module(name SOURCES ... PUBLIC ... PRIVATE ... [PRECOMPILED kind]): one library per module of docs/design.md.
# The kinds of precompiled headers are in SarnerfPrecompiled.cmake; "none" where the module's flags are its own.
function(sarnerf_module name)
  cmake_parse_arguments(ARG "" "PRECOMPILED" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(sarnerf_${name} STATIC ${ARG_SOURCES})
  add_library(sarnerf::${name} ALIAS sarnerf_${name})
  set_target_properties(sarnerf_${name} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(sarnerf_${name} PUBLIC cxx_std_20)
  target_include_directories(sarnerf_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_include_directories(sarnerf_${name} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(sarnerf_${name} PUBLIC ${ARG_PUBLIC}
    PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:sarnerf_warnings>)
  if(NOT ARG_PRECOMPILED)
    set(ARG_PRECOMPILED base)
  endif()
  if(NOT ARG_PRECOMPILED STREQUAL "none")
    sarnerf_precompiled(sarnerf_${name} ${ARG_PRECOMPILED})
  endif()
  set_property(GLOBAL APPEND PROPERTY SARNERF_MODULES sarnerf_${name})
endfunction()

# sarnerf_kernels(module source NAMESPACE set [DEFINITIONS ...] OPTIONS ...): one more instruction set of a module's
# kernels. The source is compiled with these options, and with the set's name as SARNERF_KERNEL_NAMESPACE.
function(sarnerf_kernels module source)
  cmake_parse_arguments(ARG "" "NAMESPACE" "DEFINITIONS;OPTIONS" ${ARGN})
  set(kernels sarnerf_${module}_${ARG_NAMESPACE})
  add_library(${kernels} OBJECT ${source})
  target_compile_features(${kernels} PRIVATE cxx_std_20)
  target_compile_definitions(${kernels} PRIVATE SARNERF_KERNEL_NAMESPACE=${ARG_NAMESPACE} ${ARG_DEFINITIONS}
    $<TARGET_PROPERTY:sarnerf_${module},COMPILE_DEFINITIONS>)
  target_compile_options(${kernels} PRIVATE ${ARG_OPTIONS})
  target_include_directories(${kernels} PRIVATE ${CMAKE_CURRENT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/include)
  target_link_libraries(${kernels} PRIVATE glm::glm sarnerf_warnings)
  target_sources(sarnerf_${module} PRIVATE $<TARGET_OBJECTS:${kernels}>)
endfunction()
