# Suites: writes one ctest test for each suite of a GoogleTest program, at build time.
#
# A suite runs in one process, so that its tests share the Vulkan device and the kernels that the driver has compiled. GoogleTest
# names each of its tests in the output, which `ctest --output-on-failure` shows; a crash fails the suite, and the last
# line before it names the test.
#
#   cmake -D PROGRAM=... -D FILE=written.cmake -D RESULTS=folder -D LABEL=room [-D SERIAL=suite,suite] -P suites.cmake
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ${failed}\n${listed}")
endif()
string(REPLACE "," ";" serial "${SERIAL}")
# They start first: ctest knows no times in a fresh clone, and a long suite at the end keeps one processor alone.
set(long Calibrate CheckCommand DepthRecordings Devices ExtremeContact GelContactRecordings Goals LumpScanCommand SetupCommand
  TractionRecordings TuningTest)
string(REGEX MATCHALL "(^|\n)[A-Za-z][A-Za-z0-9_/]*\\." suites "${listed}")
set(written "")
foreach(suite IN LISTS suites)
  string(STRIP "${suite}" suite)
  string(REGEX REPLACE "\\.$" "" suite "${suite}")
  string(REPLACE "/" "-" file "${suite}")
  string(APPEND written "add_test([=[${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*]=] [=[--gtest_output=xml:${RESULTS}/${LABEL}-${file}.xml]=])\n"
    "set_tests_properties([=[${suite}]=] PROPERTIES LABELS ${LABEL} TIMEOUT 3600 ENVIRONMENT PALPATE_CONFIG=none")
  if(suite IN_LIST serial)
    string(APPEND written " RUN_SERIAL ON")
  endif()
  if(suite IN_LIST long)
    string(APPEND written " COST 300")
  endif()
  string(APPEND written ")\n")
endforeach()
file(WRITE ${FILE} "${written}")
