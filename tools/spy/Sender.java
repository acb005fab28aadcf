// SPDX-License-Identifier: BSD-3-Clause
// Sends a change until a controller tells that it has it, at most TRIES times.
//
// A datagram may be lost, so the same bytes are repeated: receivers take a (session, seq) once and refuse it the second
// time. A later change ends the repeating of an earlier one, which would only arrive too late.
//
// Units    ms.
// Frames   none.
// Arrays   none.
// Memory   one connection of its own: spy's is out of a plugin's reach.
// Errors   IOException when the bus cannot be opened; what LCM cannot send it prints on stderr, and no echo comes.
package leeway.spy;

import java.io.IOException;         // no bus
import java.util.function.Consumer; // who is told how it went

import javax.swing.Timer; // repeats in the window's own thread

import lcm.lcm.LCM; // the bus

import leeway.joint_command_t; // the echo

final class Sender {
    static final int TRIES = 5;
    static final int PERIOD_MS = 100;
    // Clocks of one host differ less, those of lockstep and of real time more.
    private static final long SAME_CLOCK_NS = 10_000_000_000L;

    private final LCM bus;
    private final Echo echo = new Echo();
    private Timer timer;

    // A bus of LCM_DEFAULT_URL; a robot's name, or "" for all controllers.
    Sender(String robot) throws IOException {
        bus = new LCM();
        bus.subscribe(Echo.pattern(robot), echo);
    }

    // Sends now; `tell` hears how it went.
    void send(Change change, Consumer<String> tell) throws IOException {
        if (timer != null) {
            timer.stop();
        }
        echo.await(change);
        publish(change);
        tell.accept(change.what + " sent");
        int[] sent = {1};
        timer = new Timer(PERIOD_MS, event -> {
            if (echo.answer() == null && sent[0] < TRIES) {
                sent[0]++;
                repeat(change, tell);
                return;
            }
            timer.stop();
            tell.accept(outcome(change, System.nanoTime()));
        });
        timer.start();
    }

    private void publish(Change change) throws IOException {
        byte[] data = change.data();
        bus.publish(change.channel, data, 0, data.length);
    }

    private void repeat(Change change, Consumer<String> tell) {
        try {
            publish(change);
        } catch (IOException error) {
            timer.stop();
            tell.accept("error: " + error.getMessage());
        }
    }

    // In words, after the last try.
    private String outcome(Change change, long now) {
        joint_command_t answer = echo.answer();
        if (answer == null) {
            return change.what + " sent " + TRIES + " times; " + (echo.heardController()
                ? "the controller has not taken it: `leeway status` counts refusals" : "no controller on this bus");
        }
        String done = change.what + ": the controller has it, obstacles now: " + answer.obstacle_count;
        boolean otherClock = Math.abs(answer.tick_ns - now) > SAME_CLOCK_NS;
        return change.timed && otherClock ? done + "; its clock is another: no velocity, no lifetime" : done;
    }
}
