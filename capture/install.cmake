# Where frames come from, for other programs: libpalpate_capture (component capture), and to build with it (component
# capture_development) headers, find_package(palpate COMPONENTS capture), pkg-config.
add_library(palpate_capture_shared SHARED module_folder.cpp open_source.cpp rectify.cpp)
target_include_directories(palpate_capture_shared SYSTEM PRIVATE ${OpenCV_INCLUDE_DIRS})
set_target_properties(palpate_capture_shared PROPERTIES OUTPUT_NAME palpate_capture EXPORT_NAME capture VERSION ${PROJECT_VERSION}
  SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} LINK_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/exports.map)
target_link_options(palpate_capture_shared PRIVATE -Wl,--as-needed -Wl,--no-undefined
  -Wl,--version-script=${CMAKE_CURRENT_SOURCE_DIR}/exports.map)
# Of the engine it holds what it needs itself: sensor files, and no device.
target_link_libraries(palpate_capture_shared PUBLIC palpate_shared PRIVATE $<BUILD_INTERFACE:palpate_flags>
  $<BUILD_INTERFACE:palpate_capture>)
target_include_directories(palpate_capture_shared INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)

install(TARGETS palpate_capture_shared EXPORT palpate_capture LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT capture
  NAMELINK_COMPONENT capture_development)
install(FILES open_source.h rectify.h source.h truth.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/palpate/capture
  COMPONENT capture_development)
install(EXPORT palpate_capture NAMESPACE palpate:: FILE palpateCaptureTargets.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/palpate COMPONENT capture_development)
file(RELATIVE_PATH prefix_of_package /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(palpate-capture.pc.in ${PROJECT_BINARY_DIR}/palpate-capture.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/palpate-capture.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig
  COMPONENT capture_development)
