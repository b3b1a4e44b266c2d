include_guard(DIRECTORY)

# Debian's three small OpenCV packages come without a config file: headers under opencv4/, one library
# per component. An imported target each, included as system headers.
find_path(SARNERF_OPENCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
foreach(component IN ITEMS core imgproc imgcodecs)
  find_library(SARNERF_OPENCV_${component}_LIBRARY opencv_${component} REQUIRED)
  add_library(sarnerf_opencv_${component} INTERFACE IMPORTED)
  target_include_directories(sarnerf_opencv_${component} SYSTEM INTERFACE ${SARNERF_OPENCV_INCLUDE_DIR})
  target_link_libraries(sarnerf_opencv_${component} INTERFACE ${SARNERF_OPENCV_${component}_LIBRARY})
endforeach()
