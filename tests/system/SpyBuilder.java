// SPDX-License-Identifier: BSD-3-Clause
// The dialog's message builder without any window, for tests/system/test_spy_builder.py.
//
// Each line on stdin asks for one thing, words between tabs, and is answered by one line:
//   add|remove|clear SHAPE FIELD=TEXT...   "sent CHANNEL HEX", or "error MESSAGE" when a text is wrong
//   type NAME                              fingerprint of a wire type, in hex
//   keep FILE SHAPE FIELD=TEXT...          writes what is remembered
//   recall FILE                            "SHAPE FIELD=TEXT..."
//
// Units    session 5; utime 7 us; mono_ns 11 ns.
// Frames   see Builder.
// Arrays   none.
// Memory   one line at a time.
// Errors   any other exception ends the program.
package leeway.spy;

import java.io.BufferedReader;           // questions
import java.io.InputStreamReader;        // the same
import java.nio.charset.StandardCharsets; // the same
import java.nio.file.Paths;              // what is remembered
import java.util.EnumMap;                // texts by field
import java.util.Map;                    // the same

final class SpyBuilder {
    private static final Builder BUILDER = new Builder(new Stamp(5, () -> 7, () -> 11));

    private SpyBuilder() {
    }

    public static void main(String[] args) throws Exception {
        BufferedReader in = new BufferedReader(new InputStreamReader(System.in, StandardCharsets.UTF_8));
        for (String line = in.readLine(); line != null; line = in.readLine()) {
            System.out.println(answer(line.split("\t")));
        }
    }

    private static String answer(String[] words) throws Exception {
        switch (words[0]) {
            case "type":
                Class<?> type = Class.forName("leeway." + words[1]);
                return Long.toHexString(type.getField("LCM_FINGERPRINT").getLong(null));
            case "keep":
                new Memory(Paths.get(words[1])).save(form(words, 2));
                return "kept";
            case "recall":
                return told(new Memory(Paths.get(words[1])).load());
            default:
                return built(words);
        }
    }

    private static String built(String[] words) {
        Form form = form(words, 1);
        try {
            Change change = words[0].equals("add") ? BUILDER.add(form)
                : words[0].equals("remove") ? BUILDER.remove(form) : BUILDER.clear();
            StringBuilder hex = new StringBuilder("sent " + change.channel + " ");
            for (byte part : change.data()) {
                hex.append(String.format("%02x", part));
            }
            return hex.toString();
        } catch (FieldError error) {
            return "error " + error.getMessage();
        }
    }

    private static Form form(String[] words, int start) {
        Map<Field, String> texts = new EnumMap<>(Field.class);
        for (int i = start + 1; i < words.length; i++) {
            String[] pair = words[i].split("=", 2);
            texts.put(Field.valueOf(pair[0]), pair[1]);
        }
        return new Form(Shape.of(words[start]), texts);
    }

    private static String told(Form form) {
        StringBuilder told = new StringBuilder(form.shape.label);
        for (Field field : Field.values()) {
            told.append('\t').append(field.name()).append('=').append(form.text(field));
        }
        return told.toString();
    }
}
