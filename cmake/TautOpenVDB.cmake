# Provides the target OpenVDB::openvdb, for the library and for those who link it. OpenVDB's own find module wants the
# development files of all that OpenVDB was built with; its library alone needs TBB.

if(NOT TARGET OpenVDB::openvdb)
  find_path(OPENVDB_INCLUDE_DIR openvdb/openvdb.h)
  find_library(OPENVDB_LIBRARY openvdb)
  mark_as_advanced(OPENVDB_INCLUDE_DIR OPENVDB_LIBRARY)
  if(NOT OPENVDB_INCLUDE_DIR OR NOT OPENVDB_LIBRARY)
    message(FATAL_ERROR "OpenVDB was not found: install it (Debian: libopenvdb-dev), or set OPENVDB_INCLUDE_DIR and "
                        "OPENVDB_LIBRARY")
  endif()
  find_package(TBB REQUIRED)
  # TBB is linked, but the definition that its target asks for in debug builds (TBB_USE_DEBUG) is not taken over: the
  # libraries of a system were built without it, and ours shares its precompiled header with targets that see no TBB.
  add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
  set_target_properties(OpenVDB::openvdb PROPERTIES
                        IMPORTED_LOCATION "${OPENVDB_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES
                        "${OPENVDB_INCLUDE_DIR};$<TARGET_PROPERTY:TBB::tbb,INTERFACE_INCLUDE_DIRECTORIES>"
                        INTERFACE_LINK_LIBRARIES "$<LINK_ONLY:TBB::tbb>")
endif()
