# Writes OUTPUT, a file for CTest with a test for each suite of the GoogleTest program PROGRAM, NAME.SUITE with
# PROPERTIES. Started once a suite, not once a case, the programs take half the time.
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed COMMAND_ERROR_IS_FATAL ANY)
string(REPLACE ";" "," lines "${listed}")
string(REGEX MATCHALL "[^\n]+" lines "${lines}")
set(text "")
foreach(line IN LISTS lines)
  # The suite's name, then a full stop and of which type it is, if of any.
  if(line MATCHES "^([A-Za-z0-9_/]+)\\.( +#.*)?$")
    set(suite "${CMAKE_MATCH_1}")
    string(APPEND text "add_test(${NAME}.${suite} \"${PROGRAM}\" --gtest_brief=1 \"--gtest_filter=${suite}.*\")\n"
                       "set_tests_properties(${NAME}.${suite} PROPERTIES ${PROPERTIES})\n")
  endif()
endforeach()
if(text STREQUAL "")
  message(FATAL_ERROR "${PROGRAM} has no tests")
endif()
file(WRITE ${OUTPUT} "${text}")
