# SPDX-License-Identifier: Apache-2.0
# cmake -DOUTPUT=FILE.cpp -DROOT=DIR -DLIBRARIES=TEXT -P SqmapAlgorithm.cmake: writes what algorithm_version() returns.
file(GLOB_RECURSE sources LIST_DIRECTORIES false
     ${ROOT}/formats/include/*.hpp ${ROOT}/formats/src/*.?pp
     ${ROOT}/libbake/include/*.hpp ${ROOT}/libbake/src/*.?pp
     ${ROOT}/libruntime/include/*.hpp ${ROOT}/libruntime/src/*.?pp ${ROOT}/libruntime/src/*.inl)
list(SORT sources)
set(text "${LIBRARIES}\n")
foreach(source ${sources})
  file(SHA256 ${source} digest)
  file(RELATIVE_PATH name ${ROOT} ${source})
  string(APPEND text "${name} ${digest}\n")
endforeach()
string(SHA256 digest "${text}")
string(SUBSTRING ${digest} 0 16 digest)
file(WRITE ${OUTPUT} "// SPDX-License-Identifier: GPL-3.0-or-later
#include \"sqmap/bake/version.hpp\"

const char* sqmap::bake::algorithm_version() noexcept { return \"${digest}\"; }
")
