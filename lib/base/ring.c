// SPDX-License-Identifier: BSD-3-Clause
// Single-producer, single-consumer ring.
//
// Units    none.
// Frames   none.
// Arrays   see ring.h.
// Memory   the caller's.
// Errors   see ring.h.
#include "base/ring.h"

#include <string.h> // memcpy, memset

void lw_ring_init(struct lw_ring *ring, void *slots, size_t size, size_t capacity)
{
    memset(slots, 0, size * capacity);
    ring->slots = slots;
    ring->size = size;
    ring->capacity = capacity;
    atomic_init(&ring->written, 0);
    atomic_init(&ring->read, 0);
    atomic_init(&ring->lost, 0);
}

static unsigned char *slot(const struct lw_ring *ring, size_t number)
{
    return ring->slots + (number & (ring->capacity - 1)) * ring->size;
}

bool lw_ring_push(struct lw_ring *ring, const void *value)
{
    const size_t written = atomic_load_explicit(&ring->written, memory_order_relaxed);
    // Acquire: the reader is done with the slot before it is overwritten.
    if (written - atomic_load_explicit(&ring->read, memory_order_acquire) == ring->capacity) {
        atomic_fetch_add_explicit(&ring->lost, 1, memory_order_relaxed);
        return false;
    }
    memcpy(slot(ring, written), value, ring->size);
    atomic_store_explicit(&ring->written, written + 1, memory_order_release);
    return true;
}

bool lw_ring_pop(struct lw_ring *ring, void *value)
{
    const size_t read = atomic_load_explicit(&ring->read, memory_order_relaxed);
    if (read == atomic_load_explicit(&ring->written, memory_order_acquire))
        return false;
    memcpy(value, slot(ring, read), ring->size);
    atomic_store_explicit(&ring->read, read + 1, memory_order_release);
    return true;
}
