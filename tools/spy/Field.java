// SPDX-License-Identifier: BSD-3-Clause
// The fields of the dialog: names, what stands in them at first, which numbers they take.
//
// Units    metres, degrees, metres per second, seconds, as people type them.
// Frames   base frame of the arm.
// Arrays   none.
// Memory   constants.
// Errors   FieldError names the field.
package leeway.spy;

enum Field {
    ID("id", "1", 1, Integer.MAX_VALUE),
    X("x", "1.0", -Field.ROOM, Field.ROOM),
    Y("y", "1.0", -Field.ROOM, Field.ROOM),
    Z("z", "0.4", -Field.ROOM, Field.ROOM),
    ROLL("roll", "0", -Field.TURN, Field.TURN),
    PITCH("pitch", "0", -Field.TURN, Field.TURN),
    YAW("yaw", "0", -Field.TURN, Field.TURN),
    RADIUS("radius", "0.1", Double.MIN_VALUE, Field.ROOM),
    HALF_LENGTH("half length", "0.2", 0, Field.ROOM),
    HALF_X("half x", "0.1", Double.MIN_VALUE, Field.ROOM),
    HALF_Y("half y", "0.1", Double.MIN_VALUE, Field.ROOM),
    HALF_Z("half z", "0.1", Double.MIN_VALUE, Field.ROOM),
    ROUNDING("rounding", "0", 0, Field.ROOM),
    VERTICES("vertices", "0 0 0, 0.2 0 0, 0 0.2 0, 0 0 0.2", -Field.ROOM, Field.ROOM),
    VX("vx", "0", -Field.ROOM, Field.ROOM),
    VY("vy", "0", -Field.ROOM, Field.ROOM),
    VZ("vz", "0", -Field.ROOM, Field.ROOM),
    LIFETIME("lifetime", "0", 0, Field.LONGEST);

    // No value of an obstacle is beyond this: the controller would refuse it.
    static final double ROOM = 100;
    static final double TURN = 360;
    static final double LONGEST = Integer.MAX_VALUE / 1000;

    // Digits with a point; neither the "1d", "0x1p3" and "NaN" that Java knows nor a comma.
    private static final String DECIMAL = "[+-]?([0-9]+\\.?[0-9]*|\\.[0-9]+)([eE][+-]?[0-9]+)?";

    final String label;
    final String first;
    private final double least;
    private final double most;

    Field(String label, String first, double least, double most) {
        this.label = label;
        this.first = first;
        this.least = least;
        this.most = most;
    }

    // The number that a text says.
    double number(String text) throws FieldError {
        String word = text.trim();
        double value = word.matches(DECIMAL) ? Double.parseDouble(word) : Double.NaN;
        if (!(value >= least && value <= most)) {
            throw new FieldError(this, "expected a number " + range() + ", found \"" + word + "\"");
        }
        return value;
    }

    // The whole number that a text says.
    int integer(String text) throws FieldError {
        String word = text.trim();
        double value = word.matches("[0-9]{1,10}") ? Double.parseDouble(word) : Double.NaN;
        if (!(value >= least && value <= most)) {
            throw new FieldError(this, "expected a whole number " + range() + ", found \"" + word + "\"");
        }
        return (int) value;
    }

    private String range() {
        String from = least == Double.MIN_VALUE ? "above 0, at most " : "from " + (long) least + " to ";
        return from + (long) most;
    }
}
