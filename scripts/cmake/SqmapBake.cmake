# SPDX-License-Identifier: Apache-2.0
# find_package(sqmap CONFIG COMPONENTS bake) brings this function:
#
#   sqmap_bake(TARGET name MESHES mesh... [OUTPUT_DIR dir] [OPTIONS option...] [PROJECT file] [BUNDLES variable])
#
# Bakes each mesh to a bundle when `name` or something that depends on it is built. A mesh is baked again when it, a
# file it refers to, its sidecar, the project file, one of the options or sqbake itself has changed, and when a sidecar
# or a nearer project file appears; a bundle whose contents stay the same is left untouched.
#
#   TARGET      target to make; part of `all`
#   MESHES      mesh files, relative to the current source folder; no two may have the same name
#   OUTPUT_DIR  folder of the bundles, default: the current binary folder; mesh hand.off becomes hand.h5
#   OPTIONS     of `sqbake bake`, as on its command line; with -j, how many threads a mesh may use (default 1: the
#               build program bakes meshes side by side)
#   PROJECT     project file with options, default: the nearest sqbake.toml in the folder of each mesh or above
#   BUNDLES     variable that gets the list of bundles
function(sqmap_bake)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "TARGET;OUTPUT_DIR;PROJECT;BUNDLES" "MESHES;OPTIONS")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "sqmap_bake: unknown arguments ${arg_UNPARSED_ARGUMENTS}; known are TARGET MESHES OUTPUT_DIR "
                        "OPTIONS PROJECT BUNDLES")
  endif()
  if(NOT arg_TARGET OR NOT arg_MESHES)
    message(FATAL_ERROR "sqmap_bake: needs TARGET name and MESHES mesh...")
  endif()
  if(NOT arg_OUTPUT_DIR)
    set(arg_OUTPUT_DIR .)
  endif()
  get_filename_component(arg_OUTPUT_DIR ${arg_OUTPUT_DIR} ABSOLUTE BASE_DIR ${CMAKE_CURRENT_BINARY_DIR})
  file(MAKE_DIRECTORY ${arg_OUTPUT_DIR})
  set(options ${arg_OPTIONS})
  if(NOT "${options}" MATCHES "(^|;)(-j|--jobs)")
    list(APPEND options --jobs 1)
  endif()
  if(arg_PROJECT)
    cmake_path(ABSOLUTE_PATH arg_PROJECT BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
    list(APPEND options --config ${arg_PROJECT})
  endif()

  # A depfile names what was read, not what appears later: a sidecar, or a project file in the folder of a mesh or above.
  set(patterns)
  foreach(mesh ${arg_MESHES})
    cmake_path(ABSOLUTE_PATH mesh BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
    cmake_path(GET mesh PARENT_PATH folder)
    list(APPEND patterns ${folder}/*.sqbake.toml)
    while(NOT arg_PROJECT AND NOT ${folder}/sqbake.toml IN_LIST patterns)
      list(APPEND patterns ${folder}/sqbake.toml)
      cmake_path(GET folder PARENT_PATH folder)
    endwhile()
  endforeach()
  list(REMOVE_DUPLICATES patterns)
  file(GLOB settings_files CONFIGURE_DEPENDS ${patterns})

  set(bundles)
  foreach(mesh ${arg_MESHES})
    if(NOT mesh MATCHES "\\.[A-Za-z0-9]+$")
      message(FATAL_ERROR "sqmap_bake: MESHES holds ${mesh}, which has no extension; keywords are TARGET MESHES "
                          "OUTPUT_DIR OPTIONS PROJECT BUNDLES")
    endif()
    cmake_path(ABSOLUTE_PATH mesh BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} NORMALIZE)
    cmake_path(GET mesh STEM LAST_ONLY name)
    cmake_path(REMOVE_EXTENSION mesh LAST_ONLY OUTPUT_VARIABLE stem)
    set(bundle ${arg_OUTPUT_DIR}/${name}.h5)
    if(bundle IN_LIST bundles)
      message(FATAL_ERROR "sqmap_bake: two meshes called ${name} would both become ${bundle}; give the second a target "
                          "with another OUTPUT_DIR")
    endif()
    list(APPEND bundles ${bundle})
    set(settings)
    foreach(file ${mesh}.sqbake.toml ${stem}.sqbake.toml)
      if(file IN_LIST settings_files)
        list(APPEND settings ${file})
      endif()
    endforeach()
    set(folder ${mesh})
    cmake_path(GET folder PARENT_PATH above)
    while(NOT above STREQUAL folder)
      set(folder ${above})
      if(${folder}/sqbake.toml IN_LIST settings_files)
        list(APPEND settings ${folder}/sqbake.toml)
        break()
      endif()
      cmake_path(GET folder PARENT_PATH above)
    endwhile()
    # Only Ninja looks whether an output has changed; the others go by its time.
    set(finish)
    if(NOT CMAKE_GENERATOR MATCHES Ninja)
      set(finish COMMAND ${CMAKE_COMMAND} -E touch ${bundle})
    endif()
    add_custom_command(
      OUTPUT ${bundle}
      COMMAND sqmap::sqbake bake ${mesh} --output ${bundle} --depfile ${bundle}.d --quiet ${options} ${finish}
      DEPENDS ${mesh} ${settings} ${arg_PROJECT} sqmap::sqbake
      DEPFILE ${bundle}.d
      COMMENT "Baking ${name}.h5" VERBATIM COMMAND_EXPAND_LISTS)
  endforeach()
  add_custom_target(${arg_TARGET} ALL DEPENDS ${bundles})
  if(arg_BUNDLES)
    set(${arg_BUNDLES} ${bundles} PARENT_SCOPE)
  endif()
endfunction()
