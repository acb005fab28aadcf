// SPDX-License-Identifier: BSD-3-Clause
// Malformed: packets that no honest sender puts on the bus, one kind for each way to be wrong. None may be obeyed.
//
// Units    bytes.
// Frames   none.
// Arrays   none.
// Memory   the caller's.
// Errors   none.
#ifndef LW_TESTS_MALFORMED_H
#define LW_TESTS_MALFORMED_H

#include "tests/unit/random.h" // struct random

#include <stddef.h> // size_t
#include <stdint.h> // int64_t

enum { PACKET_MAX = 8192 };

struct packet {
    unsigned char bytes[PACKET_MAX];
    size_t size;
};

// Where packets come from. The same seed gives the same packets.
struct malformer {
    struct random random;
    int64_t plant_session;      // of the plant and of the controller under attack: what is wrong with a message is
    int64_t controller_session; // not its sender
    int64_t made;               // packets so far
    int chosen;                 // kind that the mix is at
};

struct malformed_kind {
    const char *name;
    void (*make)(struct malformer *m, struct packet *out);
    const char *what;
};

// Ends with a kind without a name.
extern const struct malformed_kind malformed_kinds[];

// Short messages: header, channel, payload.
void make_noise(struct malformer *m, struct packet *out);
void make_noise_behind_magic(struct malformer *m, struct packet *out);
void make_truncated(struct malformer *m, struct packet *out);
void make_overlong(struct malformer *m, struct packet *out);
void make_other_type(struct malformer *m, struct packet *out);
void make_no_nul(struct malformer *m, struct packet *out);
void make_long_name(struct malformer *m, struct packet *out);
void make_new_name(struct malformer *m, struct packet *out);
void make_not_finite(struct malformer *m, struct packet *out);
void make_huge(struct malformer *m, struct packet *out);
void make_count(struct malformer *m, struct packet *out);
void make_out_of_range(struct malformer *m, struct packet *out);
void make_foreign(struct malformer *m, struct packet *out);
void make_damaged(struct malformer *m, struct packet *out);

// Fragments.
void make_short_fragment(struct malformer *m, struct packet *out);
void make_wrapping_fragment(struct malformer *m, struct packet *out);
void make_zero_fragment(struct malformer *m, struct packet *out);
void make_headless_fragment(struct malformer *m, struct packet *out);
void make_huge_fragment(struct malformer *m, struct packet *out);
void make_misplaced_fragment(struct malformer *m, struct packet *out);
void make_bodiless_fragment(struct malformer *m, struct packet *out);
void make_duplicated_fragment(struct malformer *m, struct packet *out);

// Any kind, by chance.
void make_mix(struct malformer *m, struct packet *out);

// Writes big-endian.
static inline void put(unsigned char *to, uint64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++)
        to[i] = (unsigned char)(value >> (8 * (bytes - 1 - i)));
}

#endif
