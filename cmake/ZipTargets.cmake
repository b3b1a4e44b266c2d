include_guard(DIRECTORY)

# libzip's own CMake package wants its programs installed, too; its pkg-config file does not.
find_package(PkgConfig REQUIRED)
pkg_check_modules(SARNERF_ZIP REQUIRED IMPORTED_TARGET libzip>=1.7)
add_library(sarnerf_zip INTERFACE IMPORTED)
target_link_libraries(sarnerf_zip INTERFACE PkgConfig::SARNERF_ZIP)
