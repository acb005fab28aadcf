// SPDX-License-Identifier: BSD-3-Clause
// What a person has filled in: a shape and a text in every field.
//
// Units    see Field.
// Frames   base frame of the arm.
// Arrays   vertices x y z of each.
// Memory   its own copy of the texts.
// Errors   FieldError.
package leeway.spy;

import java.util.EnumMap; // texts
import java.util.Map;     // texts as they are handed over

final class Form {
    static final int MAX_VERTICES = leeway.hull_t.MAX;

    final Shape shape;
    private final Map<Field, String> texts = new EnumMap<>(Field.class);

    // Fields without a text have the one that stands in them at first.
    Form(Shape shape, Map<Field, String> given) {
        this.shape = shape;
        for (Field field : Field.values()) {
            texts.put(field, given.getOrDefault(field, field.first));
        }
    }

    String text(Field field) {
        return texts.get(field);
    }

    double number(Field field) throws FieldError {
        return field.number(text(field));
    }

    double[] numbers(Field... fields) throws FieldError {
        double[] values = new double[fields.length];
        for (int i = 0; i < fields.length; i++) {
            values[i] = number(fields[i]);
        }
        return values;
    }

    int id() throws FieldError {
        return Field.ID.integer(text(Field.ID));
    }

    // ms, rounded; 0 = until removed. A lifetime that rounds to nothing is refused.
    int lifetime() throws FieldError {
        double seconds = number(Field.LIFETIME);
        long rounded = Math.round(1000 * seconds);
        if (seconds > 0 && rounded == 0) {
            String reason = "expected 0 or at least 0.001, found \"" + text(Field.LIFETIME).trim() + "\"";
            throw new FieldError(Field.LIFETIME, reason);
        }
        return (int) rounded;
    }

    // 1 to MAX_VERTICES points.
    double[][] vertices() throws FieldError {
        String[] points = text(Field.VERTICES).split("[,;\n]", -1); // -1 keeps empty ones at the end
        if (points.length > MAX_VERTICES) {
            String reason = "expected at most " + MAX_VERTICES + " points, found " + points.length;
            throw new FieldError(Field.VERTICES, reason);
        }
        double[][] vertices = new double[points.length][];
        for (int i = 0; i < points.length; i++) {
            vertices[i] = point(points[i].trim());
        }
        return vertices;
    }

    private static double[] point(String text) throws FieldError {
        String[] words = text.split("\\s+");
        if (words.length != 3) {
            throw new FieldError(Field.VERTICES, "expected x y z, found \"" + text + "\"");
        }
        double[] values = new double[3];
        for (int i = 0; i < 3; i++) {
            values[i] = Field.VERTICES.number(words[i]);
        }
        return values;
    }
}
