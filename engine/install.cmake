# The library for other programs: libpalpate (component core), and to build with it (component development) headers,
# find_package(palpate COMPONENTS core), pkg-config.
include(CMakePackageConfigHelpers)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
install(TARGETS palpate_shared EXPORT palpate LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT core
  NAMELINK_COMPONENT development)
install(DIRECTORY include/palpate ${PROJECT_BINARY_DIR}/include/palpate DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(EXPORT palpate NAMESPACE palpate:: FILE palpateTargets.cmake DESTINATION ${package} COMPONENT development)
configure_package_config_file(palpateConfig.cmake.in ${PROJECT_BINARY_DIR}/palpateConfig.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/palpateConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/palpateConfig.cmake ${PROJECT_BINARY_DIR}/palpateConfigVersion.cmake
  DESTINATION ${package} COMPONENT development)

# Relative to the file itself, so that the prefix may move.
file(RELATIVE_PATH prefix_of_package /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_file(palpate.pc.in ${PROJECT_BINARY_DIR}/palpate.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/palpate.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
