# SPDX-License-Identifier: Apache-2.0
# What `cmake --install` puts where. Libraries come in two components, so that a user of the runtime never needs HDF5:
#   runtime   sqmap::asset, sqmap::runtime    no dependency
#   io        sqmap::io, sqmap::c             needs HDF5 and zlib
#   bake      sqmap::sqbake, sqmap_bake()     the program, for builds that bake meshes
# libbake is not installed: it is GPL and only the programs need it.
option(SQMAP_INSTALL "Install sqmap with the project that contains it" ${PROJECT_IS_TOP_LEVEL})
if(NOT SQMAP_INSTALL)
  return()
endif()
include(CMakePackageConfigHelpers)
set(SQMAP_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/sqmap)

# sqmap_install_component(NAME LIBRARY...): the libraries, and sqmap-NAME-targets.cmake that describes them.
function(sqmap_install_component component)
  foreach(library ${ARGN})
    set_target_properties(sqmap_${library} PROPERTIES EXPORT_NAME ${library})
    install(TARGETS sqmap_${library} EXPORT sqmap-${component}
            ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
            INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  endforeach()
  install(EXPORT sqmap-${component} FILE sqmap-${component}-targets.cmake NAMESPACE sqmap::
          DESTINATION ${SQMAP_PACKAGE_DIR})
endfunction()

sqmap_install_component(runtime asset runtime)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/formats/include/sqmap/asset ${PROJECT_SOURCE_DIR}/libruntime/include/sqmap/runtime
        DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sqmap)
install(FILES ${PROJECT_SOURCE_DIR}/libruntime/include/sqmap/sqmap.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sqmap)
if(TARGET sqmap_io)
  sqmap_install_component(io io c)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/formats/include/sqmap/io DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sqmap)
endif()
if(SQMAP_BUILD_BAKE)
  install(TARGETS sqbake sqinfo sqsim sqbench EXPORT sqmap-bake RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(EXPORT sqmap-bake FILE sqmap-bake-targets.cmake NAMESPACE sqmap:: DESTINATION ${SQMAP_PACKAGE_DIR})
  install(FILES ${CMAKE_CURRENT_LIST_DIR}/SqmapBake.cmake DESTINATION ${SQMAP_PACKAGE_DIR})
  # What the records of `sqbake bake --format ndjson` keep to.
  install(FILES ${PROJECT_SOURCE_DIR}/apps/sqbake/bake.schema.json ${PROJECT_SOURCE_DIR}/apps/sqbake/tools.schema.json
    DESTINATION ${CMAKE_INSTALL_DATADIR}/sqmap)
  # Each program writes its own man page and completion scripts.
  set(SQMAP_SHELL_DOCS ${PROJECT_BINARY_DIR}/shell_docs)
  file(MAKE_DIRECTORY ${SQMAP_SHELL_DOCS})
  foreach(program sqbake sqinfo sqbench)
    set(names man ${program}.1 bash ${program} zsh _${program} fish ${program}.fish)
    while(names)
      list(POP_FRONT names kind name)
      set(document ${SQMAP_SHELL_DOCS}/${name})
      add_custom_command(OUTPUT ${document} COMMAND ${program} --generate ${kind} > ${document} DEPENDS ${program}
                         VERBATIM)
      list(APPEND documents ${document})
    endwhile()
    install(FILES ${SQMAP_SHELL_DOCS}/${program}.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
    install(FILES ${SQMAP_SHELL_DOCS}/${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
    install(FILES ${SQMAP_SHELL_DOCS}/_${program} DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
    install(FILES ${SQMAP_SHELL_DOCS}/${program}.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
  endforeach()
  add_custom_target(sqmap_shell_docs ALL DEPENDS ${documents})
endif()

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/sqmapConfig.cmake.in sqmapConfig.cmake
                              INSTALL_DESTINATION ${SQMAP_PACKAGE_DIR} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(sqmapConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/sqmapConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/sqmapConfigVersion.cmake
        DESTINATION ${SQMAP_PACKAGE_DIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/LICENSES DESTINATION ${CMAKE_INSTALL_DOCDIR})
