// SPDX-License-Identifier: BSD-3-Clause
// Ring: every value of a stream, in order, from one writer thread to one reader thread.
//
// Units    none.
// Frames   none.
// Arrays   `capacity` slots of one size, a power of two.
// Memory   the caller owns the slots; nothing is allocated.
// Errors   a full ring refuses the value and counts it; neither side ever waits.
#ifndef LW_BASE_RING_H
#define LW_BASE_RING_H

#include <stdatomic.h> // atomic_size_t
#include <stdbool.h>   // bool
#include <stddef.h>    // size_t

enum { LW_RING_LINE = 64 };

struct lw_ring {
    unsigned char *slots;
    size_t size; // bytes of one slot
    size_t capacity;
    _Alignas(LW_RING_LINE) atomic_size_t written; // values written so far
    _Alignas(LW_RING_LINE) atomic_size_t read;    // values read so far
    _Alignas(LW_RING_LINE) atomic_size_t lost;    // values refused because the ring was full
};

// Starts empty; touches every slot.
void lw_ring_init(struct lw_ring *ring, void *slots, size_t size, size_t capacity);

// Writer: copies a value in. False when the ring is full.
bool lw_ring_push(struct lw_ring *ring, const void *value);

// Reader: copies the oldest value out. False when the ring is empty.
bool lw_ring_pop(struct lw_ring *ring, void *value);

#endif
