# Provides Catch2 3 for the tests, from the first of these that works, and says which:
#   1. find_package: an installed Catch2 3;
#   2. the backport of this Debian release, unpacked into TAUT_DEPS_DIR: apt's own mirror, nothing installed or changed;
#   3. the archive of the upstream release, built once into TAUT_DEPS_DIR.

include(BuildDependency)

set(catch2_version 3.7.1)
set(catch2_url https://github.com/catchorg/Catch2/archive/refs/tags/v${catch2_version}.tar.gz)
set(catch2_sha256 c991b247a1a0d7bb9c39aa35faf0fe9e19764213f28ffba3109388e62ee0269c)

if(Catch2_DIR MATCHES "^${TAUT_DEPS_DIR}/")
  unset(Catch2_DIR CACHE)  # what an earlier run put there is not the user's own
endif()
find_package(Catch2 3 QUIET)
if(Catch2_FOUND)
  message(STATUS "Catch2: ${Catch2_VERSION}, found in ${Catch2_DIR}")
  return()
endif()

set(catch2_backport "${TAUT_DEPS_DIR}/catch2-backport")
if(NOT EXISTS "${catch2_backport}/usr" AND EXISTS /usr/bin/apt-get)
  execute_process(COMMAND "${PROJECT_SOURCE_DIR}/cmake/unpack_backport" libcatch2-dev "${catch2_backport}"
                  OUTPUT_QUIET ERROR_QUIET)
endif()
find_package(Catch2 3 QUIET PATHS "${catch2_backport}/usr" NO_DEFAULT_PATH)
if(Catch2_FOUND)
  message(STATUS "Catch2: ${Catch2_VERSION}, Debian's backport, unpacked in ${catch2_backport}")
  return()
endif()

set(catch2_archive "${TAUT_DEPS_DIR}/catch2-${catch2_version}.tar.gz")
set(catch2_prefix "${TAUT_DEPS_DIR}/catch2")
taut_download(${catch2_url} ${catch2_sha256} "${catch2_archive}" downloaded)
if(NOT downloaded)
  message(FATAL_ERROR "Catch2 3 was found neither installed, nor among the backports of this system, nor at "
                      "${catch2_url}. Set Catch2_ROOT to an installed Catch2 3, or TAUT_BUILD_TESTS to OFF.")
endif()
file(ARCHIVE_EXTRACT INPUT "${catch2_archive}" DESTINATION "${TAUT_DEPS_DIR}")
taut_build_once(Catch2 "${TAUT_DEPS_DIR}/Catch2-${catch2_version}" "${catch2_prefix}" -DCMAKE_CXX_STANDARD=20)
find_package(Catch2 3 REQUIRED QUIET PATHS "${catch2_prefix}" NO_DEFAULT_PATH)
message(STATUS "Catch2: release ${catch2_version}, built in ${catch2_prefix}")
