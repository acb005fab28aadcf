// SPDX-License-Identifier: BSD-3-Clause
// A text that its field does not take.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   an exception.
// Errors   its message is for people and starts with the field's name.
package leeway.spy;

final class FieldError extends Exception {
    private static final long serialVersionUID = 1;

    final transient Field field;

    FieldError(Field field, String reason) {
        super(field.label + ": " + reason);
        this.field = field;
    }
}
