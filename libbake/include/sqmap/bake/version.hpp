// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace sqmap::bake {

/// Names the algorithm: two programs with the same name give the same bytes for the same mesh and options, on
/// processors whose C library computes alike (sqbake sees to that). 16 hex digits, a digest of the sources
/// that decide the bytes of a bundle (libbake, libruntime, formats) and of the versions of compiler and
/// libraries. Made by the build, so that nobody can forget to step it: a cache never serves what an older
/// source made.
const char* algorithm_version() noexcept;

}  // namespace sqmap::bake
