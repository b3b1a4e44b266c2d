# All third-party packages come from the distribution. Modules link the imported targets defined here.
find_package(glm REQUIRED)
find_package(TBB CONFIG REQUIRED)
find_package(nlohmann_json CONFIG REQUIRED)
find_package(CLI11 CONFIG REQUIRED)
find_package(tomlplusplus CONFIG REQUIRED)
find_package(Boost CONFIG REQUIRED)
include(OpenCVTargets)
include(RsvgTargets)

if(SARNERF_IMPORT)
  include(CsvTargets)
  include(MatioTargets)
  find_package(ZLIB REQUIRED)
endif()

if(SARNERF_SIMULATOR)
  # Debian 12 has Embree 3, Debian 13 has Embree 4; both name their target `embree`.
  find_package(embree 4 CONFIG QUIET)
  if(NOT embree_FOUND)
    find_package(embree 3 CONFIG REQUIRED)
  endif()
  # CGAL searches for Boost, which brings its own config file; CMake 3.30 and later want to be told so. A default,
  # because CGAL's files set their own policy version.
  set(CMAKE_POLICY_DEFAULT_CMP0167 NEW)
  find_package(CGAL REQUIRED)
  include(OpenVDBTargets)
endif()

if(SARNERF_NERF)
  include(TorchTargets)
  include(ZipTargets)
endif()
