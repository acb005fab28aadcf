// SPDX-License-Identifier: BSD-3-Clause
// Triple buffer: writer and reader own one slot each and swap it with the middle one in a single atomic exchange.
//
// Units    none.
// Frames   none.
// Arrays   see mailbox.h.
// Memory   the caller's.
// Errors   none.
#include "base/mailbox.h"

#include <string.h> // memset

enum { INDEX_MASK = 3, NEW = 4 };

void lw_mailbox_init(struct lw_mailbox *box, void *slots, size_t size)
{
    memset(slots, 0, LW_MAILBOX_SLOTS * size);
    box->slots = slots;
    box->size = size;
    box->write_index = 0;
    box->read_index = 1;
    atomic_init(&box->middle, 2u);
}

void *lw_mailbox_slot(struct lw_mailbox *box)
{
    return box->slots + box->write_index * box->size;
}

void lw_mailbox_publish(struct lw_mailbox *box)
{
    // Release hands over the filled slot; acquire takes the reader's old one.
    const unsigned filled = box->write_index | NEW;
    box->write_index = atomic_exchange_explicit(&box->middle, filled, memory_order_acq_rel) & INDEX_MASK;
}

const void *lw_mailbox_take(struct lw_mailbox *box, bool *fresh)
{
    // The relaxed look is a hint only; the exchange synchronises.
    *fresh = (atomic_load_explicit(&box->middle, memory_order_relaxed) & NEW) != 0;
    if (*fresh)
        box->read_index = atomic_exchange_explicit(&box->middle, box->read_index, memory_order_acq_rel) & INDEX_MASK;
    return box->slots + box->read_index * box->size;
}
