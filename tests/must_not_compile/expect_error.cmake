# cmake -D SOURCE=... -D BUILD=... -P expect_error.cmake: succeeds where SOURCE, compiled as BUILD compiles it, fails with
# the sentence that its first line announces.

file(STRINGS "${SOURCE}" first_line LIMIT_COUNT 1)
if(NOT first_line MATCHES "^// expect: (.+)$")
  message(FATAL_ERROR "${SOURCE}:1: the first line must be '// expect: SENTENCE'")
endif()
set(sentence "${CMAKE_MATCH_1}")

file(READ "${BUILD}/compile_commands.json" entries)
string(JSON last LENGTH "${entries}")
math(EXPR last "${last} - 1")
foreach(i RANGE ${last})
  string(JSON file GET "${entries}" ${i} file)
  if(file STREQUAL SOURCE)
    string(JSON command GET "${entries}" ${i} command)
    break()
  endif()
endforeach()
if(NOT command)
  message(FATAL_ERROR "${SOURCE} is not in ${BUILD}/compile_commands.json")
endif()

separate_arguments(command UNIX_COMMAND "${command}")
set(ENV{LC_ALL} C)
execute_process(COMMAND ${command} -fsyntax-only WORKING_DIRECTORY "${BUILD}" RESULT_VARIABLE status
                OUTPUT_QUIET ERROR_VARIABLE errors)
if(status EQUAL 0)
  message(FATAL_ERROR "${SOURCE} compiles, but must not")
endif()
string(FIND "${errors}" "${sentence}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "${SOURCE} does not compile, but no error says '${sentence}':\n${errors}")
endif()
