# SPDX-License-Identifier: Apache-2.0
# sqmap_target(NAME): the flags every target of this tree is built with. Contraction is off so that the same sources
# give the same numbers with and without FMA.
find_program(SQMAP_CCACHE ccache)
if(SQMAP_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SQMAP_CCACHE})
endif()

function(sqmap_target name)
  target_compile_features(${name} PUBLIC cxx_std_20)
  set_target_properties(${name} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON
                        CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  target_compile_options(${name} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Werror
                         -ffp-contract=off -fno-fast-math
                         # GCC 12 at -O3 sees overlaps in std::string that cannot be (GCC bug 105651).
                         $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict>)
  if(SQMAP_SANITIZE)
    target_compile_options(${name} PUBLIC -fsanitize=${SQMAP_SANITIZE} -fno-omit-frame-pointer
                           -fno-sanitize-recover=all)
    target_link_options(${name} PUBLIC -fsanitize=${SQMAP_SANITIZE})
  endif()
endfunction()
