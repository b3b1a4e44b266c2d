# Run at every build: writes HEADER with the revision of SOURCE, if that has changed since.
#   cmake -DSOURCE=FOLDER -DHEADER=FILE -P SarnerfRevision.cmake
cmake_minimum_required(VERSION 3.25)
set(revision unknown)
find_package(Git QUIET)
if(GIT_FOUND)
  execute_process(COMMAND ${GIT_EXECUTABLE} describe --always --dirty
    WORKING_DIRECTORY ${SOURCE} OUTPUT_VARIABLE described OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(described)
    set(revision ${described})
  endif()
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#define SARNERF_REVISION \"@revision@\"\n" @ONLY)
