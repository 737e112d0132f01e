# Debian packages, one for each component: the library, its headers, the instrument, the laboratory.
find_program(DPKG_SHLIBDEPS dpkg-shlibdeps)
if(NOT DPKG_SHLIBDEPS)
  return()
endif()
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME palpate)
set(CPACK_PACKAGE_VENDOR palpate)
set(CPACK_PACKAGE_CONTACT "palpate developers <palpate@palpate.example>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
  WORLD_EXECUTE)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_HOMEPAGE ${PALPATE_HOMEPAGE})
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_COMPONENTS_ALL)

set(version ${PROJECT_VERSION}-1)
set(gzipped ${CMAKE_CURRENT_BINARY_DIR}/changelog.Debian.gz)
find_program(GZIP gzip REQUIRED)
execute_process(COMMAND ${GZIP} -9nc ${CMAKE_CURRENT_SOURCE_DIR}/debian/changelog OUTPUT_FILE ${gzipped} COMMAND_ERROR_IS_FATAL ANY)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/debian/changelog)

# KEY VALUE pairs are those of CPackDeb (DEPENDS, RECOMMENDS, SECTION ...).
function(palpate_package component name summary description)
  string(TOUPPER ${component} upper)
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  # The summary is the first line of the description.
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}\n${description}" PARENT_SCOPE)
  while(ARGN)
    list(POP_FRONT ARGN key value)
    set(CPACK_DEBIAN_${upper}_PACKAGE_${key} ${value} PARENT_SCOPE)
  endwhile()
  install(FILES debian/copyright ${gzipped} DESTINATION ${share}/doc/${name} COMPONENT ${component})
  if(EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/debian/${name}.lintian-overrides)
    install(FILES debian/${name}.lintian-overrides DESTINATION ${share}/lintian/overrides RENAME ${name} COMPONENT ${component})
  endif()
endfunction()

set(soversion ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
palpate_package(core libpalpate${soversion} "touch sensing through a camera behind a silicone pad: library"
  "libpalpate turns frames of a camera that looks through a silicone pad into
force, shear, slip, contact shape and the surface of the pad, each with its
standard error. It computes on any Vulkan device, a processor included."
  SECTION libs RECOMMENDS mesa-vulkan-drivers)
file(CONFIGURE OUTPUT shlibs CONTENT "libpalpate ${soversion} libpalpate${soversion} (>= ${PROJECT_VERSION})\n")
set(CPACK_DEBIAN_CORE_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_SOURCE_DIR}/debian/triggers ${CMAKE_CURRENT_BINARY_DIR}/shlibs)
if(TARGET palpate_capture_shared)
  palpate_package(capture libpalpate-capture${soversion} "touch sensing through a camera behind a silicone pad: cameras"
    "libpalpate-capture gets frames for libpalpate from cameras, videos, images and
recorded sessions, and rectifies them." SECTION libs RECOMMENDS palpate)
  file(CONFIGURE OUTPUT capture/shlibs
    CONTENT "libpalpate_capture ${soversion} libpalpate-capture${soversion} (>= ${PROJECT_VERSION})\n")
  set(CPACK_DEBIAN_CAPTURE_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_SOURCE_DIR}/debian/triggers ${CMAKE_CURRENT_BINARY_DIR}/capture/shlibs)
  palpate_package(capture_development libpalpate-capture-dev "touch sensing through a camera behind a silicone pad: cameras, headers"
    "Headers of libpalpate-capture, and its files for CMake and pkg-config."
    SECTION libdevel DEPENDS "libpalpate-capture${soversion} (= ${version}), libpalpate-dev (= ${version})")
endif()
palpate_package(development libpalpate-dev "touch sensing through a camera behind a silicone pad: headers"
  "Headers of libpalpate, and its files for CMake and pkg-config."
  SECTION libdevel DEPENDS "libpalpate${soversion} (= ${version})")
palpate_package(program palpate "touch sensing through a camera behind a silicone pad"
  "palpate measures touches on optical tactile sensors: force, shear, slip,
contact shape and the surface of the pad, each with its standard error, live
in a window or from a recording. It calibrates sensors, measures Young's
modulus, finds lumps in tissue, and simulates all of it with known truth."
  DEPENDS fonts-dejavu-core RECOMMENDS "mesa-vulkan-drivers, fonts-inter, fonts-font-awesome, gnuplot-nox"
  SUGGESTS "palpate-lab, palpate-genicam")
if(TARGET palpate-lab)
  palpate_package(lab palpate-lab "laboratory of palpate: models, training, studies, benchmarks"
    "palpate-lab presses finite-element models of tissue, makes data sets of them
(HDF5), trains the networks that find lumps, judges intervals and verdicts
against known truth, times every stage and its rivals, and finds the
kernel constants that suit a device." DEPENDS "palpate (= ${version})"
    RECOMMENDS "mesa-vulkan-drivers, gnuplot-nox" SUGGESTS palpate-mpi
    REPLACES "palpate-datasets" CONFLICTS "palpate-datasets")
endif()
if(TARGET palpate_mpi)
  palpate_package(mpi palpate-mpi "data sets of pressed lumps on many processes"
    "What palpate-lab needs to share the making of data sets between the processes
of mpirun." DEPENDS "palpate-lab (= ${version}), openmpi-bin")
endif()
if(TARGET palpate_genicam)
  palpate_package(genicam palpate-genicam "touch sensing through a camera behind a silicone pad: GenICam cameras"
    "What palpate needs to open cameras of USB3 Vision and GigE Vision (Aravis)."
    DEPENDS "palpate (= ${version})")
endif()
if(TARGET palpate_python)
  # A compiled module is for one minor version.
  execute_process(COMMAND ${PALPATE_PYTHON_EXECUTABLE} -c
    "import sys; print(f'python3 (>= 3.{sys.version_info.minor}), python3 (<< 3.{sys.version_info.minor + 1})', end='')"
    OUTPUT_VARIABLE python_version COMMAND_ERROR_IS_FATAL ANY)
  palpate_package(python python3-palpate "touch sensing through a camera behind a silicone pad: Python 3"
    "The Python module palpate: recordings, cameras and arrays to force, shear,
slip and surfaces as NumPy arrays, each number with its standard error."
    SECTION python DEPENDS "palpate (= ${version}), ${python_version}, python3-numpy")
endif()

# All that the packages hold.
add_custom_target(packaged)
foreach(target IN ITEMS palpate palpate-lab palpate_shared palpate_capture_shared palpate_mpi palpate_genicam palpate_python)
  if(TARGET ${target})
    add_dependencies(packaged ${target})
  endif()
endforeach()

include(CPack)
