# What ResolveKokkos and ResolveCatch2 share: fetch an archive that may be out of reach, and build and install a CMake
# project once, at configure time.

# Downloads URL to FILE unless a FILE with that SHA256 is there. <result> is true where the file is right afterwards;
# an unreachable host is no error, for the caller has other sources to try.
function(taut_download url sha256 file result)
  if(NOT EXISTS "${file}")
    file(DOWNLOAD "${url}" "${file}" STATUS status INACTIVITY_TIMEOUT 10)
  endif()
  taut_has_sha256("${file}" ${sha256} right)
  set(${result} ${right} PARENT_SCOPE)
endfunction()

# Whether FILE has that SHA256; a FILE that has not is removed.
function(taut_has_sha256 file sha256 result)
  set(${result} FALSE PARENT_SCOPE)
  if(EXISTS "${file}")
    file(SHA256 "${file}" found)
    if(found STREQUAL sha256)
      set(${result} TRUE PARENT_SCOPE)
    else()
      file(REMOVE "${file}")
    endif()
  endif()
endfunction()

# Configures, builds and installs the project in SOURCE into PREFIX with the given options, unless PREFIX holds the
# outcome of just these options, and of the files EDITED in SOURCE, already. The log is kept beside PREFIX.
function(taut_build_once name source prefix)
  cmake_parse_arguments(PARSE_ARGV 3 built "" "" EDITED)
  set(options ${built_UNPARSED_ARGUMENTS})
  set(key "${source};${options};${CMAKE_CXX_COMPILER};${CMAKE_CXX_COMPILER_VERSION}")
  foreach(file IN LISTS built_EDITED)
    file(SHA256 "${source}/${file}" sum)
    list(APPEND key ${sum})
  endforeach()
  string(SHA256 key "${key}")
  set(stamp "${prefix}/.taut-options")
  if(EXISTS "${stamp}")
    file(READ "${stamp}" built_with)
    if(built_with STREQUAL key)
      return()
    endif()
  endif()

  message(STATUS "Building ${name} once (about a minute)")
  set(build "${prefix}-build")
  set(log "${prefix}.log")
  file(REMOVE_RECURSE "${prefix}" "${build}")
  file(WRITE "${log}" "")
  cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
  set(configure "${CMAKE_COMMAND}" -S "${source}" -B "${build}" -G "${CMAKE_GENERATOR}" -DCMAKE_BUILD_TYPE=Release
      "-DCMAKE_INSTALL_PREFIX=${prefix}" -DCMAKE_INSTALL_LIBDIR=lib "-DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER}"
      ${options})
  set(install "${CMAKE_COMMAND}" --build "${build}" --parallel ${cores} --target install)
  foreach(step configure install)
    execute_process(COMMAND ${${step}} OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE status)
    file(APPEND "${log}" "${output}")
    if(status)
      message(FATAL_ERROR "${name} did not build; what it said is in ${log}")
    endif()
  endforeach()
  file(REMOVE_RECURSE "${build}")
  file(WRITE "${stamp}" "${key}")
endfunction()
