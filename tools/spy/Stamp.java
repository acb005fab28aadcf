// SPDX-License-Identifier: BSD-3-Clause
// The header of every message: one session a process, numbers counted per channel.
//
// Units    us since the epoch; ns of CLOCK_MONOTONIC, which System.nanoTime() reads on Linux.
// Frames   none.
// Arrays   none.
// Memory   one counter a channel.
// Errors   none.
package leeway.spy;

import java.security.SecureRandom;     // the session
import java.util.HashMap;              // number by channel
import java.util.Map;                  // the same
import java.util.function.LongSupplier; // clocks that tests replace

import leeway.header_t; // what is filled

final class Stamp {
    final long session;
    private final LongSupplier utime;
    private final LongSupplier monotonic;
    private final Map<String, Long> numbers = new HashMap<>();

    Stamp() {
        this(1 + (new SecureRandom().nextLong() >>> 2), () -> 1000 * System.currentTimeMillis(), System::nanoTime);
    }

    Stamp(long session, LongSupplier utime, LongSupplier monotonic) {
        this.session = session;
        this.utime = utime;
        this.monotonic = monotonic;
    }

    // The header of the next message of a channel.
    header_t next(String channel) {
        header_t h = new header_t();
        h.utime = utime.getAsLong();
        h.mono_ns = monotonic.getAsLong();
        h.session = session;
        h.seq = numbers.merge(channel, 1L, Long::sum);
        return h;
    }
}
