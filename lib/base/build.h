// SPDX-License-Identifier: BSD-3-Clause
// Which build this is: version and compiler, set by CMake.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   constants.
// Errors   none.
#ifndef LW_BASE_BUILD_H
#define LW_BASE_BUILD_H

#ifndef LW_VERSION
#error "CMake defines LW_VERSION"
#endif

#define LW_BUILD "leeway " LW_VERSION ", C compiler " __VERSION__

#endif
