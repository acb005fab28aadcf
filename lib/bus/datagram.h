// SPDX-License-Identifier: BSD-3-Clause
// Datagram: receives one LCM channel on a multicast socket of its own, in the calling thread, without LCM's threads.
// The kernel keeps away all that is not a short LCM message (LC02) of the channel; fragments (LC03) are never taken.
//
// Units    ms for timeouts, bytes for sizes.
// Frames   none.
// Arrays   none.
// Memory   struct lw_datagram is the caller's and belongs to one thread; nothing here allocates.
// Errors   open says what to do in struct lw_error; receive tells a lasting failure from a passing one, which it
// counts.
#ifndef LW_BUS_DATAGRAM_H
#define LW_BUS_DATAGRAM_H

#include "base/schema.h" // struct lw_error
#include "bus/wire.h"    // LW_WIRE_MAX

#include <linux/filter.h> // struct sock_filter
#include <netinet/in.h>   // struct sockaddr_in
#include <stdbool.h>      // bool
#include <stddef.h>       // size_t
#include <stdint.h>       // uint32_t

enum {
    LW_DATAGRAM_NAME = 64,    // a channel's name with its NUL, at most
    LW_DATAGRAM_FILTER = 40,  // instructions of a filter, at most
    LW_DATAGRAM_ERRORS = 100, // this many passing errors with nothing in between are a lasting one
    // Whatever the name's length, a message that is cut to the buffer is still longer than LW_WIRE_MAX.
    LW_DATAGRAM_BYTES = 8 + LW_DATAGRAM_NAME + LW_WIRE_MAX + 1
};

struct lw_datagram {
    char channel[LW_DATAGRAM_NAME]; // empty = not open
    int fd;
    int timeout_ms;  // what the socket waits by itself, < 0 = without end
    int64_t refused; // packets that are no message of the channel; the filter lets none through
    int64_t errors;  // receptions that failed for a passing reason
    int errors_in_row;
    unsigned char buffer[LW_DATAGRAM_BYTES];
};

// Opens the socket: it shares the port with LCM's own sockets and joins the group on the interface that the kernel
// routes it to, as LCM does.
//   group          multicast address and port, network byte order
//   channel        1..63 bytes
//   receive_bytes  kernel buffer asked for, which net.core.rmem_max limits; 0 = the system's default
// Fails LW_E_ARGUMENT (group, channel), LW_E_BUS (no multicast route, port taken).
LW_MUST_CHECK enum lw_status lw_datagram_open(struct lw_datagram *d, const struct sockaddr_in *group,
                                              const char *channel, int receive_bytes, struct lw_error *error);

// Closes; does nothing with one that is all zeros or already closed.
void lw_datagram_close(struct lw_datagram *d);

// Waits up to timeout_ms for a message: 0 = takes only what is there, < 0 = waits without end. The kernel's timer tick
// makes a wait up to two ticks longer (8 ms at 250 Hz), one beyond 64 ticks by more. Who has an exact deadline waits
// for fd with ppoll and takes with 0. Shutting fd down ends a wait from another thread, with -1.
//   payload, size  out  a message; points into d until the next call. One longer than LW_WIRE_MAX may be cut, and
//                       then its size still is greater than LW_WIRE_MAX, so that decoding refuses it
// Returns 1 = a message; 0 = none: time is over, a signal came, or something was counted in d; -1 = the socket is of no
// use any more. Cost: one system call, one more when the wait is not that of the call before.
LW_MUST_CHECK int lw_datagram_receive(struct lw_datagram *d, int timeout_ms, const void **payload, uint32_t *size);

// When the message came that the next receive takes: ns of the system's clock, to compare with that of another socket.
// 0 = there is none. Cost: one system call.
int64_t lw_datagram_arrival_ns(const struct lw_datagram *d);

// Finds the payload of a packet. False, outputs unchanged, unless it is a short LCM message of exactly this channel.
bool lw_datagram_parse(const void *packet, size_t size, const char *channel, const void **payload,
                       uint32_t *payload_size);

// Builds the socket filter that passes what lw_datagram_parse takes. It sees 8 bytes of UDP header before the packet.
//   out  [max] LW_DATAGRAM_FILTER is enough for every channel
// Returns the number of instructions; 0 = channel empty or too long, or max too small.
int lw_datagram_filter(const char *channel, struct sock_filter *out, int max);

#endif
