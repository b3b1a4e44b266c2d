include_guard(DIRECTORY)

# OpenVDB's own find module wants Boost.Iostreams, which nothing here uses, and puts an old search for TBB
# first on the path. This target needs neither.
find_path(SARNERF_OPENVDB_INCLUDE_DIR openvdb/openvdb.h REQUIRED)
find_library(SARNERF_OPENVDB_LIBRARY openvdb REQUIRED)
find_package(Imath CONFIG REQUIRED)
add_library(sarnerf_openvdb INTERFACE IMPORTED)
target_include_directories(sarnerf_openvdb SYSTEM INTERFACE ${SARNERF_OPENVDB_INCLUDE_DIR})
target_link_libraries(sarnerf_openvdb INTERFACE ${SARNERF_OPENVDB_LIBRARY} TBB::tbb Imath::Imath)
