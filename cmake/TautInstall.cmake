# cmake --install: the library with its headers, the program with its scenes, and a package for find_package(Taut). A
# Kokkos that was built here goes into the same prefix, so that the user of the package needs no other.

include(CMakePackageConfigHelpers)
set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/Taut")

install(TARGETS taut taut_late taut_all taut_usage EXPORT TautTargets)
foreach(room IN LISTS rooms)
  if(IS_DIRECTORY "${PROJECT_SOURCE_DIR}/${room}")
    install(DIRECTORY ${room} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/taut FILES_MATCHING PATTERN "*.hpp")
  endif()
endforeach()
if(TAUT_BUILT_KOKKOS)
  install(DIRECTORY "${kokkos_prefix}/" DESTINATION . USE_SOURCE_PERMISSIONS PATTERN .taut-options EXCLUDE)
endif()

install(EXPORT TautTargets NAMESPACE Taut:: DESTINATION ${package_folder})
configure_package_config_file(cmake/TautConfig.cmake.in "${PROJECT_BINARY_DIR}/TautConfig.cmake"
                              INSTALL_DESTINATION ${package_folder} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file("${PROJECT_BINARY_DIR}/TautConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/TautConfig.cmake" "${PROJECT_BINARY_DIR}/TautConfigVersion.cmake"
              cmake/TautOpenVDB.cmake DESTINATION ${package_folder})
