// SPDX-License-Identifier: BSD-3-Clause
// A change of the obstacles, ready to be sent.
//
// Units    those of lcmtypes/*.lcm.
// Frames   base frame of the arm.
// Arrays   none.
// Memory   holds the bytes alone: the same ones however often it is sent.
// Errors   none.
package leeway.spy;

import java.io.IOException; // what writing to memory declares

import lcm.lcm.LCMDataOutputStream; // encoding
import lcm.lcm.LCMEncodable;        // a message

import leeway.header_t; // who sends it

final class Change {
    final String channel;
    final long session;
    final long seq;
    // Whether the controller's clock matters to it: it moves, or it expires.
    final boolean timed;
    // For people: "sphere 7 at 1 1 0.4".
    final String what;
    private final byte[] data;

    Change(String channel, header_t h, LCMEncodable message, boolean timed, String what) {
        this.channel = channel;
        this.session = h.session;
        this.seq = h.seq;
        this.timed = timed;
        this.what = what;
        this.data = encode(message);
    }

    byte[] data() {
        return data.clone();
    }

    private static byte[] encode(LCMEncodable message) {
        try {
            LCMDataOutputStream out = new LCMDataOutputStream();
            message.encode(out);
            return out.toByteArray();
        } catch (IOException error) {
            throw new IllegalStateException("a message in memory cannot be written", error);
        }
    }
}
