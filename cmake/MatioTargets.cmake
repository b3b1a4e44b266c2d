include_guard(DIRECTORY)

# libmatio's pkg-config file names HDF5, which nothing here calls.
find_path(SARNERF_MATIO_INCLUDE_DIR matio.h REQUIRED)
find_library(SARNERF_MATIO_LIBRARY matio REQUIRED)
add_library(sarnerf_matio INTERFACE IMPORTED)
target_include_directories(sarnerf_matio SYSTEM INTERFACE ${SARNERF_MATIO_INCLUDE_DIR})
target_link_libraries(sarnerf_matio INTERFACE ${SARNERF_MATIO_LIBRARY})
