// SPDX-License-Identifier: BSD-3-Clause
// Mailbox: the newest value of a stream, handed from one writer thread to one reader thread (triple buffer).
//
// Units    none.
// Frames   none.
// Arrays   three slots of one size.
// Memory   the caller owns the slots (LW_MAILBOX_SLOTS of them, 64-byte aligned); nothing is allocated.
// Errors   none. Both sides are wait-free; neither ever blocks the other.
#ifndef LW_BASE_MAILBOX_H
#define LW_BASE_MAILBOX_H

#include <stdatomic.h> // atomic_uint
#include <stdbool.h>   // bool
#include <stddef.h>    // size_t

enum { LW_MAILBOX_SLOTS = 3, LW_CACHE_LINE = 64 };

struct lw_mailbox {
    unsigned char *slots;                         // LW_MAILBOX_SLOTS * size bytes
    size_t size;                                  // bytes of one slot
    _Alignas(LW_CACHE_LINE) atomic_uint middle;   // slot between the two sides, plus the NEW bit
    _Alignas(LW_CACHE_LINE) unsigned write_index; // owned by the writer
    _Alignas(LW_CACHE_LINE) unsigned read_index;  // owned by the reader
};

// Starts with nothing new; a first take returns the zeroed slot.
//   slots  in  LW_MAILBOX_SLOTS values of `size` bytes, kept by the mailbox; zeroed here
void lw_mailbox_init(struct lw_mailbox *box, void *slots, size_t size);

// Writer: the slot to fill. It holds a value two or more writes old, so fill all of it.
void *lw_mailbox_slot(struct lw_mailbox *box);

// Writer: hands the filled slot over.
void lw_mailbox_publish(struct lw_mailbox *box);

// Reader: the newest value; stays valid and unchanged until the next take.
//   fresh  out  true when it was published after the previous take
const void *lw_mailbox_take(struct lw_mailbox *box, bool *fresh);

#endif
