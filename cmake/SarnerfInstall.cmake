# The installed package: libraries, headers, programs and data, and a config file that searches only for
# what the requested components need.
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/sarnerf)

# Our libraries are static, so even their private dependencies reach the consumer's link line. Target to
# the name under which sarnerfConfig.cmake searches for its package.
set(package_of_glm::glm glm)
set(package_of_TBB::tbb TBB)
set(package_of_TBB::tbbmalloc TBB)
set(package_of_Threads::Threads Threads)
set(package_of_nlohmann_json::nlohmann_json nlohmann_json)
set(package_of_CLI11::CLI11 CLI11)
set(package_of_embree embree)
set(package_of_CGAL::CGAL CGAL)
set(package_of_sarnerf_openvdb OpenVDB)
set(package_of_sarnerf_rsvg Rsvg)
set(package_of_sarnerf_torch Torch)
set(package_of_sarnerf_csv Csv)
set(package_of_sarnerf_matio Matio)
set(package_of_ZLIB::ZLIB ZLIB)
set(package_of_sarnerf_zip Zip)
foreach(component IN ITEMS core imgproc imgcodecs)
  set(package_of_sarnerf_opencv_${component} OpenCV)
endforeach()

# One export set per module, so that a component can be loaded without the dependencies of the others.
get_property(modules GLOBAL PROPERTY SARNERF_MODULES)
set(SARNERF_COMPONENTS "")
set(SARNERF_REQUIREMENTS "")
foreach(target IN LISTS modules)
  get_target_property(module ${target} EXPORT_NAME)
  get_target_property(links ${target} LINK_LIBRARIES)
  set(needs_modules "")
  set(needs_packages "")
  foreach(link IN LISTS links)
    if(link MATCHES "^\\$<BUILD_INTERFACE:")
      continue()
    elseif(link MATCHES "^sarnerf::(.+)$")
      list(APPEND needs_modules ${CMAKE_MATCH_1})
    elseif(DEFINED package_of_${link})
      list(APPEND needs_packages ${package_of_${link}})
    elseif(link)
      message(FATAL_ERROR "Module ${module} links ${link}, which the installed package cannot find: "
                          "add its package to cmake/SarnerfInstall.cmake and cmake/sarnerfConfig.cmake.in")
    endif()
  endforeach()
  list(REMOVE_DUPLICATES needs_packages)
  list(APPEND SARNERF_COMPONENTS ${module})
  string(APPEND SARNERF_REQUIREMENTS
    "set(_sarnerf_${module}_modules ${needs_modules})\n"
    "set(_sarnerf_${module}_packages ${needs_packages})\n")

  install(TARGETS ${target} EXPORT sarnerf-${module} ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT sarnerf-${module} NAMESPACE sarnerf:: DESTINATION ${package_dir}
          FILE sarnerf-${module}.cmake)
  if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/include/sarnerf/${module})
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/sarnerf/${module}
            DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sarnerf FILES_MATCHING PATTERN "*.h")
  endif()
endforeach()

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/sarnerfConfig.cmake.in
  ${PROJECT_BINARY_DIR}/sarnerfConfig.cmake INSTALL_DESTINATION ${package_dir}
  NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/sarnerfConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/sarnerfConfig.cmake
  ${PROJECT_BINARY_DIR}/sarnerfConfigVersion.cmake
  ${PROJECT_SOURCE_DIR}/cmake/CsvTargets.cmake
  ${PROJECT_SOURCE_DIR}/cmake/MatioTargets.cmake
  ${PROJECT_SOURCE_DIR}/cmake/OpenCVTargets.cmake
  ${PROJECT_SOURCE_DIR}/cmake/OpenVDBTargets.cmake
  ${PROJECT_SOURCE_DIR}/cmake/RsvgTargets.cmake
  ${PROJECT_SOURCE_DIR}/cmake/TorchTargets.cmake
  ${PROJECT_SOURCE_DIR}/cmake/ZipTargets.cmake
  DESTINATION ${package_dir})

foreach(program IN ITEMS sar_render sar_bench sar_nerf_train sar_nerf_render sar_nerf_bench sar_extract sar_import sar_fewshot
        sar_recognise)
  if(TARGET ${program})
    install(TARGETS ${program} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  endif()
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/data/ DESTINATION ${CMAKE_INSTALL_DATADIR}/sarnerf OPTIONAL
        PATTERN "CMakeLists.txt" EXCLUDE PATTERN "*.cpp" EXCLUDE)
install(FILES LICENSE THIRD_PARTY.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
