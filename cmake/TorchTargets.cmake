include_guard(DIRECTORY)

# LibTorch's own package sets warnings and looks for a compiler of CUDA; the distribution's works without either. Its
# headers count as the system's, so that our warnings stay ours.
find_package(Torch CONFIG REQUIRED QUIET)
add_library(sarnerf_torch INTERFACE IMPORTED)
target_link_libraries(sarnerf_torch INTERFACE torch)
target_include_directories(sarnerf_torch SYSTEM INTERFACE ${TORCH_INCLUDE_DIRS})
