# Provides Kokkos::kokkos for TAUT_BACKEND, from the first of these that works, and says which:
#   1. find_package: a build of the user's own (Kokkos_ROOT), Spack's, a module's;
#   2. the archive of the upstream release;
#   3. a Python source distribution that ships the same release unmodified, through pip as it is set up here.
# The last two are built once into TAUT_DEPS_DIR.

include(BuildDependency)

set(kokkos_version 4.7.00)
set(kokkos_url https://github.com/kokkos/kokkos/releases/download/${kokkos_version}/kokkos-${kokkos_version}.tar.gz)
set(kokkos_sha256 126b774a24dde8c1085c4aede7564c0b7492d6a07d85380f2b387a712cea1ff5)
set(kokkos_sdist pygenten-0.1.5)
set(kokkos_sdist_sha256 e620f05c742905e2db705d875f1cac92ef0ed453f9e6734e9beda26cc0f9cce7)

# The tree of the release in <source>, where it came from in <origin>.
function(taut_kokkos_source source origin)
  set(tree "${TAUT_DEPS_DIR}/kokkos-${kokkos_version}")
  set(from_sdist "${TAUT_DEPS_DIR}/${kokkos_sdist}/tpls/kokkos")
  if(EXISTS "${tree}/CMakeLists.txt")
    set(from "release ${kokkos_version}")
  elseif(EXISTS "${from_sdist}/CMakeLists.txt")
    set(tree "${from_sdist}")
    set(from "release ${kokkos_version} out of ${kokkos_sdist}")
  else()
    set(archive "${TAUT_DEPS_DIR}/kokkos-${kokkos_version}.tar.gz")
    taut_download(${kokkos_url} ${kokkos_sha256} "${archive}" downloaded)
    if(downloaded)
      set(from "release ${kokkos_version}")
      file(ARCHIVE_EXTRACT INPUT "${archive}" DESTINATION "${TAUT_DEPS_DIR}")
    else()
      taut_pip_download("${TAUT_DEPS_DIR}/${kokkos_sdist}.tar.gz" ${kokkos_sdist_sha256})
      set(tree "${from_sdist}")
      set(from "release ${kokkos_version} out of ${kokkos_sdist}")
      file(ARCHIVE_EXTRACT INPUT "${TAUT_DEPS_DIR}/${kokkos_sdist}.tar.gz" DESTINATION "${TAUT_DEPS_DIR}"
           PATTERNS "${kokkos_sdist}/tpls/kokkos/*")
    endif()
  endif()
  set(${source} "${tree}" PARENT_SCOPE)
  set(${origin} "${from}" PARENT_SCOPE)
endfunction()

# Brings the source distribution FILE (NAME-VERSION.tar.gz) through pip; a Python without pip gets a private environment.
function(taut_pip_download file sha256)
  taut_has_sha256("${file}" ${sha256} there)
  if(there)
    return()
  endif()
  find_program(TAUT_PYTHON NAMES python3 REQUIRED)
  mark_as_advanced(TAUT_PYTHON)
  set(python "${TAUT_PYTHON}")
  execute_process(COMMAND "${python}" -m pip --version RESULT_VARIABLE no_pip OUTPUT_QUIET ERROR_QUIET)
  if(no_pip)
    execute_process(COMMAND "${python}" -m venv "${TAUT_DEPS_DIR}/pip" OUTPUT_QUIET ERROR_QUIET)
    set(python "${TAUT_DEPS_DIR}/pip/bin/python3")
  endif()
  cmake_path(GET file PARENT_PATH folder)
  cmake_path(GET file FILENAME name)
  string(REGEX REPLACE "-([0-9.]+)\\.tar\\.gz$" "==\\1" requirement "${name}")
  execute_process(COMMAND "${python}" -m pip download --quiet --no-deps --no-binary :all: --dest "${folder}" "${requirement}"
                  RESULT_VARIABLE status ERROR_VARIABLE error)
  taut_has_sha256("${file}" ${sha256} there)
  if(NOT there)
    message(FATAL_ERROR "Kokkos was found neither installed, nor at ${kokkos_url}, nor through pip "
                        "(${requirement}: ${status} ${error}). Set Kokkos_ROOT to an installed Kokkos 4.5 or later.")
  endif()
endfunction()

# CUDA 13 changed the signatures of two functions that this release of Kokkos calls; later releases have the same edits.
function(taut_adapt_kokkos_to_cuda_13 source)
  set(header "${source}/core/src/Cuda/Kokkos_Cuda_Instance.hpp")
  file(READ "${header}" original)
  set(text "${original}")
  string(REPLACE "cudaGraphAddDependencies(graph, from, to, numDependencies)"
                 "cudaGraphAddDependencies(graph, from, to, nullptr, numDependencies)" text "${text}")
  string(REPLACE "cudaMemPrefetchAsync(devPtr, count, dstDevice, m_stream)"
                 "cudaMemPrefetchAsync(devPtr, count, {cudaMemLocationTypeDevice, dstDevice}, 0, m_stream)" text "${text}")
  taut_write_edited("${header}")
endfunction()

# Writes `text` to FILE if it is not `original`: presets share the source, and another one may be building from it.
macro(taut_write_edited file)
  if(NOT text STREQUAL original)
    file(WRITE "${file}" "${text}")
  endif()
endmacro()

# Releases up to 5.0 compare packs of doubles for AVX-512 the wrong way round by > and >= (Kokkos pull request 8797).
set(kokkos_wrong_way "static_cast<__m512d>\\(rhs\\),([ \n]*)static_cast<__m512d>\\(lhs\\),([ \n]*)_CMP_G")

# Turns them in SOURCE.
function(taut_mend_kokkos_avx512 source)
  set(header "${source}/simd/src/Kokkos_SIMD_AVX512.hpp")
  file(READ "${header}" original)
  string(REGEX REPLACE "${kokkos_wrong_way}"
         "static_cast<__m512d>(lhs),\\1static_cast<__m512d>(rhs),\\2_CMP_G" text "${original}")
  taut_write_edited("${header}")
endfunction()

# Refuses a Kokkos for AVX-512 that has them.
function(taut_check_kokkos_avx512)
  set(folders "")
  foreach(target IN ITEMS Kokkos::kokkoscore Kokkos::kokkossimd)
    if(TARGET ${target})
      get_target_property(of_target ${target} INTERFACE_INCLUDE_DIRECTORIES)
      list(APPEND folders ${of_target})
    endif()
  endforeach()
  string(REGEX REPLACE "\\$<[A-Z_]+:([^>]*)>" "\\1" folders "${folders}")
  set(avx512 "")
  set(text "")
  foreach(folder IN LISTS folders)
    if(EXISTS "${folder}/KokkosCore_config.h")
      file(STRINGS "${folder}/KokkosCore_config.h" avx512 REGEX "define KOKKOS_ARCH_AVX512XEON")
    endif()
    if(EXISTS "${folder}/Kokkos_SIMD_AVX512.hpp")
      file(READ "${folder}/Kokkos_SIMD_AVX512.hpp" text)
    endif()
  endforeach()
  if(avx512 AND text MATCHES "${kokkos_wrong_way}")
    message(FATAL_ERROR "The Kokkos in ${Kokkos_DIR} compares packs of doubles for AVX-512 the wrong way round "
                        "(Kokkos pull request 8797): apply that to it, or configure with "
                        "-DCMAKE_DISABLE_FIND_PACKAGE_Kokkos=ON to let Taut build its own.")
  endif()
endfunction()

if(TAUT_BACKEND STREQUAL "openmp")
  set(kokkos_wanted OPENMP SERIAL)
elseif(TAUT_BACKEND STREQUAL "serial")
  set(kokkos_wanted SERIAL)
elseif(TAUT_BACKEND STREQUAL "cuda")
  set(kokkos_wanted CUDA SERIAL)
  string(REGEX MATCH "[0-9]+$" CMAKE_CUDA_ARCHITECTURES "${TAUT_CUDA_ARCH}")
  string(APPEND CMAKE_CUDA_FLAGS " -std=c++20")  # CMake 3.25 passes nvcc 13 no standard by itself
  enable_language(CUDA)
else()
  message(FATAL_ERROR "TAUT_BACKEND is '${TAUT_BACKEND}'; it must be openmp, serial or cuda.")
endif()

set(kokkos_prefix "${TAUT_DEPS_DIR}/kokkos-${TAUT_BACKEND}")
if(TAUT_CHECKED)
  string(APPEND kokkos_prefix "-debug")
endif()
if(Kokkos_DIR MATCHES "^${TAUT_DEPS_DIR}/")
  unset(Kokkos_DIR CACHE)  # what an earlier run built here is not the user's own
endif()

find_package(Kokkos 4.5...<6 QUIET)
if(Kokkos_FOUND)
  set(TAUT_BUILT_KOKKOS FALSE)
  foreach(device IN LISTS kokkos_wanted)
    if(NOT device IN_LIST Kokkos_DEVICES)
      message(FATAL_ERROR "The Kokkos in ${Kokkos_DIR} has no ${device}; build it with -DKokkos_ENABLE_${device}=ON, "
                          "or configure with -DCMAKE_DISABLE_FIND_PACKAGE_Kokkos=ON to let Taut build its own.")
    endif()
  endforeach()
  message(STATUS "Kokkos: ${Kokkos_VERSION}, found in ${Kokkos_DIR}")
else()
  set(TAUT_BUILT_KOKKOS TRUE)
  taut_kokkos_source(kokkos_source kokkos_origin)
  set(kokkos_options
      -DCMAKE_CXX_STANDARD=20
      -DKokkos_ENABLE_DEPRECATED_CODE_4=OFF
      -DKokkos_ARCH_NATIVE=ON
      -DKokkos_ENABLE_DEBUG_BOUNDS_CHECK=${TAUT_CHECKED})
  foreach(device IN LISTS kokkos_wanted)
    list(APPEND kokkos_options -DKokkos_ENABLE_${device}=ON)
  endforeach()
  if(TAUT_BACKEND STREQUAL "cuda")
    list(APPEND kokkos_options
         -DKokkos_ARCH_${TAUT_CUDA_ARCH}=ON
         -DKokkos_ENABLE_COMPILE_AS_CMAKE_LANGUAGE=ON
         -DCMAKE_CUDA_COMPILER=${CMAKE_CUDA_COMPILER}
         -DCMAKE_CUDA_ARCHITECTURES=${CMAKE_CUDA_ARCHITECTURES}
         -DCMAKE_CUDA_FLAGS=-std=c++20)
    if(CMAKE_CUDA_COMPILER_VERSION VERSION_GREATER_EQUAL 13)
      taut_adapt_kokkos_to_cuda_13("${kokkos_source}")
    endif()
  endif()
  taut_mend_kokkos_avx512("${kokkos_source}")
  taut_build_once(Kokkos "${kokkos_source}" "${kokkos_prefix}" ${kokkos_options}
                  EDITED simd/src/Kokkos_SIMD_AVX512.hpp)
  set(CMAKE_DISABLE_FIND_PACKAGE_Kokkos FALSE)
  unset(Kokkos_DIR CACHE)  # of one that was found earlier, and refused
  find_package(Kokkos REQUIRED QUIET PATHS "${kokkos_prefix}" NO_DEFAULT_PATH)
  message(STATUS "Kokkos: ${kokkos_origin}, built in ${kokkos_prefix}")
endif()
taut_check_kokkos_avx512()
