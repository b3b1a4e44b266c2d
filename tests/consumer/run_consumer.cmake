# Script of the consumer tests; the variables come from CMakeLists.txt beside it.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(REMOVE_RECURSE ${work_dir})
run(${CMAKE_COMMAND} --install ${binary_dir} --prefix ${work_dir}/prefix)
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/project -B ${work_dir}/build -G ${generator}
    -D CMAKE_PREFIX_PATH=${work_dir}/prefix
    -D CMAKE_BUILD_TYPE=${build_type}
    -D CMAKE_CXX_COMPILER=${cxx_compiler}
    "-DCMAKE_CXX_FLAGS=${cxx_flags}"
    -D COMPONENT=${component})
run(${CMAKE_COMMAND} --build ${work_dir}/build)
run(${work_dir}/build/use_${component} ${work_dir})
