// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace sqmap::apps {

/// Has the C library use the same pow, exp, sin, ... on every x86-64 processor. It picks variants with fused
/// multiply-add where it can, whose last bits differ, and bundles would differ with them; only the
/// environment of a new process changes that. Returns where nothing is to be changed or can be; otherwise the
/// program starts again, with the same arguments.
void use_plain_math(char** argv);

}  // namespace sqmap::apps
