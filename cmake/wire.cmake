# LCM (from PyPI) and the code that lcm-gen makes of lcmtypes/*.lcm.
find_package(Python3 COMPONENTS Interpreter REQUIRED)
execute_process(
  COMMAND ${Python3_EXECUTABLE} -c "import lcm, os; print(os.path.dirname(os.path.dirname(lcm.__file__)))"
  OUTPUT_VARIABLE LEEWAY_SITE_PACKAGES OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT LEEWAY_SITE_PACKAGES)
  message(FATAL_ERROR "${Python3_EXECUTABLE} has no lcm: run ./dev setup, or pip install lcm==1.5.3")
endif()
list(APPEND CMAKE_PREFIX_PATH ${LEEWAY_SITE_PACKAGES})
find_package(lcm 1.5 CONFIG REQUIRED) # the version keeps Debian's 1.3.1 out
include(${LCM_USE_FILE})

file(GLOB LEEWAY_LCM_FILES CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/lcmtypes/*.lcm)
lcm_wrap_types(C_HEADERS wire_headers C_SOURCES wire_sources ${LEEWAY_LCM_FILES})
add_library(leeway_wire STATIC ${wire_sources} ${wire_headers})
target_include_directories(leeway_wire SYSTEM PUBLIC ${CMAKE_CURRENT_BINARY_DIR})
target_link_libraries(leeway_wire PUBLIC lcm)
