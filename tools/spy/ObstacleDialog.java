// SPDX-License-Identifier: BSD-3-Clause
// The dialog: shape, id, place, size, velocity and lifetime of an obstacle; add or move, remove, clear.
//
// Every status is also a line on stdout. Alt and the underlined letter lead to a row, the tabulator to its next field,
// and a field that is reached is selected as a whole, so that the dialog can be used without a mouse.
//
// Units    as the fields say.
// Frames   base frame of the arm.
// Arrays   none.
// Memory   one text field a Field, hidden where the shape does not have it.
// Errors   are shown and nothing is sent.
package leeway.spy;

import java.awt.BorderLayout;        // form above, buttons below
import java.awt.Color;               // errors
import java.awt.Dimension;           // of the window around it
import java.awt.FlowLayout;          // fields of a row
import java.awt.GridBagConstraints;  // rows
import java.awt.GridBagLayout;       // rows
import java.awt.Insets;              // rows
import java.awt.Window;              // the window around it
import java.awt.event.FocusAdapter;  // selects what is reached
import java.awt.event.FocusEvent;    // the same
import java.io.IOException;          // bus or file
import java.util.EnumMap;            // text field by field
import java.util.Map;                // the same

import javax.swing.BorderFactory;      // margins
import javax.swing.JButton;            // what to do
import javax.swing.JComboBox;          // shape
import javax.swing.JComponent;         // parts
import javax.swing.JDesktopPane;       // where it opens
import javax.swing.JFrame;             // the window around it
import javax.swing.JInternalFrame;     // it
import javax.swing.JLabel;             // names
import javax.swing.JPanel;             // parts
import javax.swing.JTextArea;          // status
import javax.swing.JTextField;         // texts
import javax.swing.SwingUtilities;     // the window around it

final class ObstacleDialog {
    private static final String TITLE = "Leeway obstacles";
    private static final int COLUMNS = 7;
    private static final int WIDE = 34;
    private static final Color WRONG = new Color(0xb00000);

    private final Builder builder;
    private final Sender sender;
    private final Memory memory;
    private final JComboBox<Shape> shape = new JComboBox<>(Shape.values());
    private final Map<Field, JTextField> inputs = new EnumMap<>(Field.class);
    private final JPanel sizes = new JPanel(new FlowLayout(FlowLayout.LEFT, 4, 0));
    private final JLabel sizeName = new JLabel("Size [m]");
    private final JLabel hint = new JLabel(" ");
    private final JTextArea status = new JTextArea(2, 40);
    private final JInternalFrame frame = new JInternalFrame(TITLE, true, false, false, false);

    // What a button does with the form.
    private interface Command {
        void perform(Form form) throws FieldError, IOException;
    }

    ObstacleDialog(Builder builder, Sender sender, Memory memory) {
        this.builder = builder;
        this.sender = sender;
        this.memory = memory;
        for (Field field : Field.values()) {
            inputs.put(field, input(field == Field.VERTICES ? WIDE : COLUMNS));
        }
        fill();
        frame.add(rows(), BorderLayout.CENTER);
        frame.add(foot(), BorderLayout.SOUTH);
        shape.addActionListener(event -> showSizes());
        shape.setKeySelectionManager((key, shapes) -> Shape.startingWith(key));
        showSizes();
    }

    // Fills the pane and makes the window around it as large as all fields need.
    void open(JDesktopPane pane, String channel) throws IOException {
        pane.setPreferredSize(largest());
        pane.add(frame);
        Window window = SwingUtilities.getWindowAncestor(pane);
        if (window instanceof JFrame) {
            ((JFrame) window).setTitle(TITLE + ": " + channel);
            window.pack();
        }
        frame.setBounds(0, 0, pane.getWidth(), pane.getHeight());
        frame.setVisible(true);
        try {
            frame.setMaximum(true);
            frame.setSelected(true);
        } catch (java.beans.PropertyVetoException veto) {
            throw new IOException("the dialog cannot be shown", veto);
        }
        inputs.get(Field.ID).requestFocusInWindow();
        say("dialog opened from " + channel);
    }

    // Room for the sizes of any shape.
    private Dimension largest() {
        Shape before = chosen();
        Dimension size = new Dimension();
        for (Shape each : Shape.values()) {
            shape.setSelectedItem(each);
            Dimension wanted = frame.getPreferredSize();
            size.setSize(Math.max(size.width, wanted.width), Math.max(size.height, wanted.height));
        }
        shape.setSelectedItem(before);
        return size;
    }

    // --- parts ---

    private static JTextField input(int columns) {
        JTextField input = new JTextField(columns);
        input.addFocusListener(new FocusAdapter() {
            @Override
            public void focusGained(FocusEvent event) {
                input.selectAll();
            }
        });
        return input;
    }

    private JPanel rows() {
        JPanel rows = new JPanel(new GridBagLayout());
        rows.setBorder(BorderFactory.createEmptyBorder(6, 8, 4, 8));
        JPanel first = new JPanel(new FlowLayout(FlowLayout.LEFT, 4, 0));
        first.add(shape);
        JLabel id = new JLabel("   Id");
        name(id, 'I', inputs.get(Field.ID));
        first.add(id);
        first.add(inputs.get(Field.ID));
        addRow(rows, 0, new JLabel("Shape"), 'S', first, shape);
        addRow(rows, 1, new JLabel("Position [m]"), 'P', Field.X, Field.Y, Field.Z);
        addRow(rows, 2, new JLabel("Orientation [deg]"), 'O', Field.ROLL, Field.PITCH, Field.YAW);
        addRow(rows, 3, sizeName, 'Z', sizes, null);
        addRow(rows, 4, new JLabel(), '\0', hint, null);
        addRow(rows, 5, new JLabel("Velocity [m/s]"), 'V', Field.VX, Field.VY, Field.VZ);
        JPanel last = new JPanel(new FlowLayout(FlowLayout.LEFT, 4, 0));
        last.add(inputs.get(Field.LIFETIME));
        last.add(new JLabel("0: until it is removed"));
        addRow(rows, 6, new JLabel("Lifetime [s]"), 'L', last, inputs.get(Field.LIFETIME));
        return rows;
    }

    private void addRow(JPanel rows, int y, JLabel name, char key, Field... fields) {
        JPanel row = new JPanel(new FlowLayout(FlowLayout.LEFT, 4, 0));
        for (Field field : fields) {
            row.add(new JLabel(field.label));
            row.add(inputs.get(field));
        }
        addRow(rows, y, name, key, row, inputs.get(fields[0]));
    }

    private static void addRow(JPanel rows, int y, JLabel name, char key, JComponent row, JComponent target) {
        name(name, key, target);
        GridBagConstraints place = new GridBagConstraints();
        place.gridy = y;
        place.anchor = GridBagConstraints.WEST;
        place.insets = new Insets(3, 0, 3, 6);
        rows.add(name, place);
        place.weightx = 1;
        rows.add(row, place);
    }

    private static void name(JLabel label, char key, JComponent target) {
        label.setDisplayedMnemonic(key);
        label.setLabelFor(target);
    }

    private JPanel foot() {
        JPanel buttons = new JPanel(new FlowLayout(FlowLayout.LEFT));
        JButton add = button("Add / Move", 'A', this::add);
        buttons.add(add);
        buttons.add(button("Remove", 'R', form -> sender.send(builder.remove(form), this::say)));
        buttons.add(button("Clear all", 'C', form -> sender.send(builder.clear(), this::say)));
        frame.getRootPane().setDefaultButton(add);
        status.setEditable(false);
        status.setFocusable(false);
        status.setLineWrap(true);
        status.setWrapStyleWord(true);
        status.setOpaque(false);
        status.setBorder(BorderFactory.createEmptyBorder(0, 10, 6, 8));
        JPanel foot = new JPanel(new BorderLayout());
        foot.add(buttons, BorderLayout.NORTH);
        foot.add(status, BorderLayout.CENTER);
        return foot;
    }

    private JButton button(String name, char key, Command command) {
        JButton button = new JButton(name);
        button.setMnemonic(key);
        button.addActionListener(event -> perform(command));
        return button;
    }

    // --- what happens ---

    private void fill() {
        Form form = new Form(Shape.SPHERE, new EnumMap<>(Field.class));
        try {
            form = memory.load();
        } catch (IOException error) {
            say("what was sent last cannot be read: " + error);
        }
        shape.setSelectedItem(form.shape);
        for (Field field : Field.values()) {
            inputs.get(field).setText(form.text(field));
        }
    }

    private Shape chosen() {
        return (Shape) shape.getSelectedItem();
    }

    // The fields of the chosen shape's size.
    private void showSizes() {
        sizes.removeAll();
        for (Field field : chosen().sizes()) {
            sizes.add(new JLabel(field == Field.VERTICES ? "" : field.label));
            sizes.add(inputs.get(field));
        }
        Field[] fields = chosen().sizes();
        sizeName.setLabelFor(fields.length > 0 ? inputs.get(fields[0]) : shape);
        hint.setText(chosen().hint.isEmpty() ? " " : chosen().hint);
        sizes.revalidate();
        sizes.repaint();
    }

    private void perform(Command command) {
        Map<Field, String> texts = new EnumMap<>(Field.class);
        inputs.forEach((field, input) -> texts.put(field, input.getText()));
        Form form = new Form(chosen(), texts);
        try {
            command.perform(form);
        } catch (FieldError error) {
            say("error: " + error.getMessage());
            inputs.get(error.field).requestFocusInWindow();
        } catch (IOException | RuntimeException error) {
            // Left alone it would be a stack trace on stderr that nobody sees.
            error.printStackTrace();
            say("error: " + error);
        }
    }

    // Only what was good enough to be sent is remembered.
    private void add(Form form) throws FieldError, IOException {
        sender.send(builder.add(form), this::say);
        try {
            memory.save(form);
        } catch (IOException error) {
            System.err.println("leeway: these values will not be remembered: " + error);
        }
    }

    private void say(String text) {
        status.setForeground(text.startsWith("error") ? WRONG : Color.BLACK);
        status.setText(text);
        System.out.println("leeway: " + text);
    }
}
