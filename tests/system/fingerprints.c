// SPDX-License-Identifier: BSD-3-Clause
// Prints name and fingerprint of every wire type as the C programs have them, one a line, for
// tests/system/test_spy_builder.py.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   none.
// Errors   exit status 0.
#include <inttypes.h> // PRIx64
#include <stdio.h>    // printf

#include "wire_types.h" // LEEWAY_WIRE_TYPES and the types, made by tests/CMakeLists.txt

#define PRINT(name) printf("%s %" PRIx64 "\n", #name, (uint64_t)__leeway_##name##_get_hash());

int main(void)
{
    LEEWAY_WIRE_TYPES(PRINT)
    return 0;
}
