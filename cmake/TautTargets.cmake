# How every target of this repository is compiled.

if(PROJECT_IS_TOP_LEVEL)
  if(NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "Release, Debug, RelWithDebInfo or MinSizeRel" FORCE)
  endif()
  set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
  find_program(TAUT_CCACHE ccache)
  mark_as_advanced(TAUT_CCACHE)
  if(TAUT_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    # The sloppiness is what ccache asks for before it caches a source that uses a precompiled header.
    set(ccache "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros "${TAUT_CCACHE}")
    set(CMAKE_CXX_COMPILER_LAUNCHER ${ccache})
    set(CMAKE_CUDA_COMPILER_LAUNCHER ${ccache})
  endif()
endif()
include(GNUInstallDirs)
# What most sources include and what is slow to read, parsed once: the intrinsics behind the packs of Kokkos alone are a
# second of each source. Not in it is what few sources need (JSON, Eigen): reading a larger file back costs all of them.
set(taut_precompiled <Kokkos_Core.hpp> <Kokkos_SIMD.hpp> <filesystem> <fmt/ranges.h>)
if(TAUT_BACKEND STREQUAL "cuda")
  set(CMAKE_DISABLE_PRECOMPILE_HEADERS ON)  # ours is Kokkos's header, which here only nvcc can read
endif()

# What whoever includes our headers needs too: kernels are templates, so their speed is decided in the user's translation
# unit. Vectorising a loop over sqrt and selects needs both flags; neither changes a result. (-ffast-math would: it lets
# the compiler reorder sums.)
add_library(taut_usage INTERFACE)
set_target_properties(taut_usage PROPERTIES EXPORT_NAME usage)
target_compile_features(taut_usage INTERFACE cxx_std_20)
target_compile_options(taut_usage INTERFACE $<$<COMPILE_LANGUAGE:CXX>:-fno-math-errno -fno-trapping-math>)
# GCC would copy a matrix of packs (9 registers) by a call of memcpy, and keep it in memory; with these it does not.
target_compile_options(taut_usage INTERFACE
  "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CXX_COMPILER_ID:GNU>>:-fno-tree-loop-distribute-patterns;--param=sra-max-scalarization-size-Ospeed=2048>")
# Under nvcc fmt 9 takes it that there is no constexpr, and does not compile; Eigen marks its functions for the device,
# and warns. We use both on the host alone.
target_compile_definitions(taut_usage INTERFACE $<$<COMPILE_LANGUAGE:CUDA>:FMT_USE_CONSTEXPR=1 EIGEN_NO_CUDA>)
# Tests and examples instantiate more kernels than the program and run each for moments: optimising them less saves half
# of their compile time. The library and the program, which the tests of commands start, are optimised as ever.
set(taut_optimise_less "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-Og>")
if(TAUT_CHECKED)
  set(sanitizers -fsanitize=address,undefined)
  # The sanitizers name lines; knowing of variables too would take the compiler twice as long.
  target_compile_options(taut_usage INTERFACE ${sanitizers} -fno-sanitize-recover=all -fno-omit-frame-pointer -O1 -g1)
  target_link_options(taut_usage INTERFACE ${sanitizers})
endif()

# The headers of GCC 12.0 to 12.2 for AVX-512 hand undefined registers to instructions that do not read them, and the
# compiler takes that for a mistake wherever it inlines them (GCC bug 105593).
set(taut_false_alarms)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 12
   AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 12.3)
  include(CheckCXXSourceCompiles)
  set(CMAKE_REQUIRED_FLAGS -march=native)  # what the Kokkos that is built here compiles for
  check_cxx_source_compiles("#ifndef __AVX512F__\n#error\n#endif\nint main() {}" TAUT_AVX512)
  unset(CMAKE_REQUIRED_FLAGS)
  if(TAUT_AVX512)
    set(taut_false_alarms -Wno-uninitialized -Wno-maybe-uninitialized)
  endif()
endif()

# Whether FILE includes Kokkos, itself or through headers of ours.
function(taut_reaches_kokkos file result)
  get_property(known GLOBAL PROPERTY "taut_reaches_kokkos ${file}")
  if("${known}" STREQUAL "")
    set(known FALSE)
    file(STRINGS "${file}" includes REGEX "^#include ")
    cmake_path(GET file PARENT_PATH beside)
    foreach(include IN LISTS includes)
      if(include MATCHES "<Kokkos_")
        set(known TRUE)
      elseif(include MATCHES "[<\"](taut/)?([^>\"]+\\.hpp)[>\"]")
        set(header "${CMAKE_MATCH_2}")
        foreach(folder "${PROJECT_SOURCE_DIR}" "${PROJECT_SOURCE_DIR}/tests" "${beside}")
          if(NOT known AND EXISTS "${folder}/${header}")
            taut_reaches_kokkos("${folder}/${header}" known)
          endif()
        endforeach()
      endif()
    endforeach()
    set_property(GLOBAL PROPERTY "taut_reaches_kokkos ${file}" ${known})
  endif()
  set(${result} ${known} PARENT_SCOPE)
endfunction()

# Compiles the sources of TARGET SIZE at a time, but for those that match APART, which take long enough by themselves:
# what several include and instantiate is then compiled once. Names without linkage must be unique among them.
function(taut_join target size)
  cmake_parse_arguments(PARSE_ARGV 2 join "" APART "")
  if(NOT TAUT_JOINT OR TAUT_BACKEND STREQUAL "cuda")
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE BATCH UNITY_BUILD_BATCH_SIZE ${size})
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "(${join_APART})\\.cpp$")
  set_source_files_properties(${sources} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# Sets TARGET up as one of ours: language, warnings.
function(taut_target target)
  target_link_libraries(${target} PUBLIC taut_usage)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  set(warnings -Wall -Wextra -Wshadow ${taut_false_alarms})
  if(TAUT_BACKEND STREQUAL "cuda")
    # What reaches Kokkos is nvcc's; the rest (toml++ is too much for nvcc) stays with the host's compiler.
    get_target_property(sources ${target} SOURCES)
    foreach(source IN LISTS sources)
      cmake_path(ABSOLUTE_PATH source BASE_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}" OUTPUT_VARIABLE file)
      taut_reaches_kokkos("${file}" reaches)
      if(reaches)
        set_source_files_properties(${source} PROPERTIES LANGUAGE CUDA)
      endif()
    endforeach()
    list(JOIN warnings "," host_warnings)
    target_compile_options(${target} PRIVATE
      $<$<COMPILE_LANGUAGE:CUDA>:-Xcompiler=${host_warnings} $<$<BOOL:${TAUT_WARNINGS_AS_ERRORS}>:-Werror=all-warnings>>
      $<$<COMPILE_LANGUAGE:CXX>:${warnings} $<$<BOOL:${TAUT_WARNINGS_AS_ERRORS}>:-Werror>>)
  else()
    target_compile_options(${target} PRIVATE ${warnings} -Wpedantic $<$<BOOL:${TAUT_WARNINGS_AS_ERRORS}>:-Werror>)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
      target_compile_options(${target} PRIVATE -fpch-preprocess)  # for ccache
      # GCC collects its garbage when its heap has grown by so many kB: a tenth of the time, for a quarter more memory.
      target_compile_options(${target} PRIVATE --param=ggc-min-heapsize=1500000)
    endif()
  endif()
endfunction()
