// SPDX-License-Identifier: BSD-3-Clause
// What the fuzz targets share: a check that stays in every build, and reading values from the fuzzer's bytes.
//
// Units    of the caller.
// Frames   of the caller.
// Arrays   of the caller.
// Memory   none.
// Errors   a failed check prints itself and ends the process, which the fuzzer reports with the bytes that led there.
#ifndef LW_TESTS_FUZZ_H
#define LW_TESTS_FUZZ_H

#include <stddef.h> // size_t
#include <stdint.h> // uint8_t
#include <stdio.h>  // fprintf
#include <stdlib.h> // abort

#define CHECK(condition) ((condition) ? (void)0 : fail(#condition, __FILE__, __LINE__))

static inline void fail(const char *condition, const char *file, int line)
{
    fprintf(stderr, "%s:%d: does not hold: %s\n", file, line, condition);
    abort();
}

// Bytes not read yet; behind the end there are zeros.
struct bytes {
    const uint8_t *data;
    size_t size;
};

static inline int next_byte(struct bytes *bytes)
{
    if (bytes->size == 0)
        return 0;
    bytes->size--;
    return *bytes->data++;
}

// libFuzzer calls this with every input it makes. Returns 0.
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#endif
