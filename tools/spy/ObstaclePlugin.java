// SPDX-License-Identifier: BSD-3-Clause
// The plugin that lcm-spy finds: adds "Inject obstacle..." to the menu of some channels.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   one sender for all dialogs of a spy.
// Errors   what goes wrong while a dialog opens is shown in a window.
package leeway.spy;

import java.awt.event.ActionEvent;                 // menu item
import java.io.IOException;                        // no bus
import java.util.concurrent.atomic.AtomicBoolean;  // first instance

import javax.swing.AbstractAction; // menu item
import javax.swing.Action;         // the same
import javax.swing.JDesktopPane;   // where the dialog goes
import javax.swing.JOptionPane;    // error

import lcm.spy.ChannelData; // the row
import lcm.spy.SpyPlugin;   // what spy looks for: has to be named here, a superclass is not seen

import leeway.joint_state_t; // types whose rows have the item
import leeway.obstacles_t;   // the same

public final class ObstaclePlugin implements SpyPlugin {
    static final String ITEM = "Inject obstacle...";

    // Spy makes one instance for each time that it meets the jar, twice as it is started; one of them acts.
    private static final AtomicBoolean TAKEN = new AtomicBoolean();
    private static final Stamp STAMP = new Stamp();
    private static Sender sender;

    private final boolean active = TAKEN.compareAndSet(false, true);

    @Override
    public boolean canHandle(long fingerprint) {
        return active && (fingerprint == obstacles_t.LCM_FINGERPRINT || fingerprint == joint_state_t.LCM_FINGERPRINT);
    }

    // Spy asks with (null, null) for the item's name alone.
    @Override
    public Action getAction(JDesktopPane pane, ChannelData channel) {
        return new AbstractAction(ITEM) {
            private static final long serialVersionUID = 1;

            @Override
            public void actionPerformed(ActionEvent event) {
                try {
                    new ObstacleDialog(new Builder(STAMP), sender(), Memory.ofUser()).open(pane, channel.name);
                } catch (IOException | RuntimeException error) {
                    error.printStackTrace();
                    JOptionPane.showMessageDialog(pane, error.toString(), ITEM, JOptionPane.ERROR_MESSAGE);
                }
            }
        };
    }

    // All dialogs share one connection and one sequence.
    private static synchronized Sender sender() throws IOException {
        if (sender == null) {
            String robot = System.getenv("LEEWAY_NAME");
            sender = new Sender(robot == null ? "" : robot);
        }
        return sender;
    }

    @Override
    public String toString() {
        return active ? "Leeway obstacles: active" : "Leeway obstacles: second copy of the same jar, idle";
    }
}
