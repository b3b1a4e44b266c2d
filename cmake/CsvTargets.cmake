include_guard(DIRECTORY)

# libcsv comes without a config file of any kind.
find_path(SARNERF_CSV_INCLUDE_DIR csv.h REQUIRED)
find_library(SARNERF_CSV_LIBRARY csv REQUIRED)
add_library(sarnerf_csv INTERFACE IMPORTED)
target_include_directories(sarnerf_csv SYSTEM INTERFACE ${SARNERF_CSV_INCLUDE_DIR})
target_link_libraries(sarnerf_csv INTERFACE ${SARNERF_CSV_LIBRARY})
