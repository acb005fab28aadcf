// SPDX-License-Identifier: BSD-3-Clause
// Makes messages of what a person has filled in. No windows here, so that it can be tested without any.
//
// Units    those of lcmtypes/*.lcm; degrees and seconds in the form.
// Frames   base frame of the arm. Roll, pitch, yaw turn about the fixed x, then y, then z axis, as in a URDF.
// Arrays   quaternions w x y z.
// Memory   a new message each time.
// Errors   FieldError; then no number of the sequence is used up.
package leeway.spy;

import java.util.Arrays; // every slot of a message

import leeway.header_t;    // parts of a message
import leeway.hull_t;      // a hull with its vertices
import leeway.obstacle_t;  // one obstacle
import leeway.obstacles_t; // any other change

final class Builder {
    static final String OBSTACLES = "OBSTACLES";
    static final String HULL = "HULL";

    private final Stamp stamp;

    Builder(Stamp stamp) {
        this.stamp = stamp;
    }

    // Adds an obstacle, or puts the one with its id elsewhere.
    Change add(Form form) throws FieldError {
        obstacle_t o = obstacle(form);
        int lifetime = form.lifetime();
        boolean timed = lifetime > 0 || o.v[0] != 0 || o.v[1] != 0 || o.v[2] != 0;
        String what = form.shape + " " + o.id + " at " + form.text(Field.X).trim() + " "
            + form.text(Field.Y).trim() + " " + form.text(Field.Z).trim();
        if (form.shape == Shape.HULL) {
            hull_t m = hull(o, form.vertices(), lifetime);
            return new Change(HULL, m.h, m, timed, what);
        }
        obstacles_t m = obstacles(obstacles_t.UPSERT, o);
        m.valid_for_ms = lifetime;
        return new Change(OBSTACLES, m.h, m, timed, what);
    }

    // Removes the obstacle with the form's id; no other field is read.
    Change remove(Form form) throws FieldError {
        obstacle_t o = new obstacle_t();
        o.id = form.id();
        o.quat[0] = 1;
        obstacles_t m = obstacles(obstacles_t.REMOVE, o);
        return new Change(OBSTACLES, m.h, m, false, "removal of " + o.id);
    }

    // Removes all obstacles of all senders.
    Change clear() {
        obstacles_t m = obstacles(obstacles_t.CLEAR);
        return new Change(OBSTACLES, m.h, m, false, "removal of all");
    }

    // --- parts ---

    private static obstacle_t obstacle(Form form) throws FieldError {
        obstacle_t o = new obstacle_t();
        o.id = form.id();
        o.shape = form.shape.number;
        o.p = form.numbers(Field.X, Field.Y, Field.Z);
        o.quat = quaternion(form.numbers(Field.ROLL, Field.PITCH, Field.YAW));
        fillSize(form, o);
        o.v = form.numbers(Field.VX, Field.VY, Field.VZ);
        return o;
    }

    private static void fillSize(Form form, obstacle_t o) throws FieldError {
        switch (form.shape) {
            case SPHERE:
                o.radius = form.number(Field.RADIUS);
                break;
            case CAPSULE:
                o.radius = form.number(Field.RADIUS);
                o.size[0] = form.number(Field.HALF_LENGTH);
                break;
            case BOX:
                o.size = form.numbers(Field.HALF_X, Field.HALF_Y, Field.HALF_Z);
                o.radius = form.number(Field.ROUNDING);
                break;
            case HULL:
                o.radius = form.number(Field.ROUNDING);
                break;
            default: // a plane has none
                break;
        }
    }

    // Of roll, pitch and yaw in degrees. StrictMath gives the same bits on every machine.
    static double[] quaternion(double[] turn) {
        double[] c = new double[3];
        double[] s = new double[3];
        for (int i = 0; i < 3; i++) {
            c[i] = StrictMath.cos(Math.toRadians(turn[i]) / 2);
            s[i] = StrictMath.sin(Math.toRadians(turn[i]) / 2);
        }
        return new double[] {
            c[0] * c[1] * c[2] + s[0] * s[1] * s[2],
            s[0] * c[1] * c[2] - c[0] * s[1] * s[2],
            c[0] * s[1] * c[2] + s[0] * c[1] * s[2],
            c[0] * c[1] * s[2] - s[0] * s[1] * c[2]};
    }

    private obstacles_t obstacles(byte op, obstacle_t... used) {
        obstacles_t m = new obstacles_t();
        m.h = stamp.next(OBSTACLES);
        m.time_ns = m.h.mono_ns;
        m.op = op;
        m.n = used.length;
        // lcm-gen leaves the slots without an object; also those that nobody reads are encoded.
        Arrays.setAll(m.o, i -> i < used.length ? used[i] : new obstacle_t());
        return m;
    }

    private hull_t hull(obstacle_t o, double[][] vertices, int lifetime) {
        hull_t m = new hull_t();
        header_t h = stamp.next(HULL);
        m.h = h;
        m.time_ns = h.mono_ns;
        m.valid_for_ms = lifetime;
        m.o = o;
        m.n = vertices.length;
        for (int i = 0; i < vertices.length; i++) {
            m.vertex[i] = vertices[i];
        }
        return m;
    }
}
