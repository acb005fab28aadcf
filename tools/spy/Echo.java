// SPDX-License-Identifier: BSD-3-Clause
// Hears the controllers of the bus: has one taken in a change?
//
// Units    ns of the controller's clock.
// Frames   none.
// Arrays   none.
// Memory   the newest change that was waited for, and its answer. Written by LCM's thread, read by the window's.
// Errors   what is no joint_command_t is passed over, as by every receiver.
package leeway.spy;

import java.io.IOException; // a message of another type

import lcm.lcm.LCM;                // the bus
import lcm.lcm.LCMDataInputStream; // a message's bytes
import lcm.lcm.LCMSubscriber;      // called by LCM

import leeway.joint_command_t; // tells the newest message about obstacles

final class Echo implements LCMSubscriber {
    private Change awaited;
    private boolean controller;
    private joint_command_t answer;

    // Channels of the controllers: of one robot, or of all.
    static String pattern(String robot) {
        return robot.isEmpty() ? "(.+_)?JOINT_COMMAND" : robot + "_JOINT_COMMAND";
    }

    synchronized void await(Change change) {
        awaited = change;
        controller = false;
        answer = null;
    }

    // Whether any controller was heard since then.
    synchronized boolean heardController() {
        return controller;
    }

    // The first command that tells of the change, or of a later one; null while there is none.
    synchronized joint_command_t answer() {
        return answer;
    }

    @Override
    public void messageReceived(LCM lcm, String channel, LCMDataInputStream in) {
        joint_command_t command;
        try {
            command = new joint_command_t(in);
        } catch (IOException | RuntimeException notSuchMessage) {
            return;
        }
        take(command);
    }

    private synchronized void take(joint_command_t command) {
        controller = true;
        if (awaited != null && answer == null && tells(command)) {
            answer = command;
        }
    }

    // Numbers are counted per channel.
    private boolean tells(joint_command_t command) {
        byte channel = awaited.channel.equals(Builder.HULL) ? joint_command_t.HULL : joint_command_t.OBSTACLES;
        return command.world_channel == channel && command.world_session == awaited.session
            && command.world_seq >= awaited.seq;
    }
}
