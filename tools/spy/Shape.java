// SPDX-License-Identifier: BSD-3-Clause
// The shapes that the dialog offers, and the fields that each has for its size.
//
// Units    metres.
// Frames   a shape's own: see lcmtypes/obstacle_t.lcm.
// Arrays   none.
// Memory   constants.
// Errors   none.
package leeway.spy;

import leeway.obstacle_t; // numbers of the shapes

enum Shape {
    SPHERE("sphere", obstacle_t.SPHERE, "", Field.RADIUS),
    CAPSULE("capsule", obstacle_t.CAPSULE, "its axis is its own z", Field.RADIUS, Field.HALF_LENGTH),
    BOX("box", obstacle_t.BOX, "half of each edge", Field.HALF_X, Field.HALF_Y, Field.HALF_Z, Field.ROUNDING),
    PLANE("plane", obstacle_t.HALFSPACE, "all below its own z = 0 is solid; the position is any point of its face"),
    HULL("hull", obstacle_t.HULL, "vertices x y z, commas between them", Field.VERTICES, Field.ROUNDING);

    final String label;
    final byte number;
    final String hint;
    private final Field[] sizes;

    Shape(String label, byte number, String hint, Field... sizes) {
        this.label = label;
        this.number = number;
        this.hint = hint;
        this.sizes = sizes;
    }

    Field[] sizes() {
        return sizes.clone();
    }

    // The shape of a name, a sphere when there is no such name.
    static Shape of(String label) {
        for (Shape shape : values()) {
            if (shape.label.equals(label)) {
                return shape;
            }
        }
        return SPHERE;
    }

    // Number of the shape whose name starts with a letter, -1 when there is none.
    static int startingWith(char letter) {
        for (Shape shape : values()) {
            if (shape.label.charAt(0) == Character.toLowerCase(letter)) {
                return shape.ordinal();
            }
        }
        return -1;
    }

    @Override
    public String toString() {
        return label;
    }
}
