// SPDX-License-Identifier: BSD-3-Clause
// Digest: FNV-1a over 64-bit words, so that two ticks can tell whether they were given the same bits.
//
// Units    none.
// Frames   none.
// Arrays   lengths as stated.
// Memory   none.
// Errors   none.
#ifndef LW_BASE_DIGEST_H
#define LW_BASE_DIGEST_H

#include <stdint.h> // uint64_t
#include <string.h> // memcpy

#define LW_DIGEST_START UINT64_C(0xcbf29ce484222325)

// Each step is invertible, so one changed bit of one word always changes the digest.
static inline uint64_t lw_digest_word(uint64_t digest, uint64_t word)
{
    digest = (digest ^ word) * UINT64_C(0x100000001b3);
    return digest ^ (digest >> 32);
}

static inline uint64_t lw_digest_int(uint64_t digest, int64_t value)
{
    return lw_digest_word(digest, (uint64_t)value);
}

// Bit patterns: 0.0 and -0.0 differ.
static inline uint64_t lw_digest_doubles(uint64_t digest, const double *values, int n)
{
    for (int i = 0; i < n; i++) {
        uint64_t word;
        memcpy(&word, &values[i], sizeof word);
        digest = lw_digest_word(digest, word);
    }
    return digest;
}

#endif
