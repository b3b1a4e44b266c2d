include_guard(DIRECTORY)

# librsvg comes with a pkg-config file only. It names cairo, which our code calls too.
find_package(PkgConfig REQUIRED)
pkg_check_modules(SARNERF_RSVG REQUIRED IMPORTED_TARGET librsvg-2.0>=2.52)
add_library(sarnerf_rsvg INTERFACE IMPORTED)
target_link_libraries(sarnerf_rsvg INTERFACE PkgConfig::SARNERF_RSVG)
