# Script of the test of sar_recognise as a project of its own; the variables come from CMakeLists.txt beside it.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(REMOVE_RECURSE ${work_dir})
run(${CMAKE_COMMAND} -S ${source_dir} -B ${work_dir} -G ${generator}
    -D CMAKE_PREFIX_PATH=${torch_prefix}
    -D CMAKE_UNITY_BUILD=ON
    -D CMAKE_BUILD_TYPE=${build_type}
    -D CMAKE_CXX_COMPILER=${cxx_compiler})
run(${CMAKE_COMMAND} --build ${work_dir})
run(${work_dir}/sar_recognise --help)
