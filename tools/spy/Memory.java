// SPDX-License-Identifier: BSD-3-Clause
// What the dialog last sent, kept from one start to the next in leeway/spy.properties below XDG_CONFIG_HOME.
//
// A file that people can read and remove; java.util.prefs would keep it in a folder of its own and start a thread.
//
// Units    those of the fields: texts are kept as they were typed.
// Frames   base frame of the arm.
// Arrays   none.
// Memory   one small file.
// Errors   IOException; a file that lacks a field leaves that field as it is at first.
package leeway.spy;

import java.io.IOException;              // folder or file cannot be used
import java.io.Reader;                   // reading
import java.io.Writer;                   // writing
import java.nio.file.Files;              // the file
import java.nio.file.Path;               // its place
import java.nio.file.Paths;              // the same
import java.nio.file.StandardCopyOption; // replaced as a whole
import java.util.EnumMap;                // texts by field
import java.util.Map;                    // the same
import java.util.Properties;             // the format

final class Memory {
    private static final String SHAPE = "shape";

    private final Path file;

    Memory(Path file) {
        this.file = file;
    }

    // Of this user.
    static Memory ofUser() {
        String base = System.getenv("XDG_CONFIG_HOME");
        boolean told = base != null && !base.isEmpty();
        Path folder = told ? Paths.get(base) : Paths.get(System.getProperty("user.home"), ".config");
        return new Memory(folder.resolve("leeway").resolve("spy.properties"));
    }

    Form load() throws IOException {
        Properties kept = new Properties();
        if (Files.exists(file)) {
            try (Reader in = Files.newBufferedReader(file)) {
                kept.load(in);
            } catch (IllegalArgumentException error) {
                throw new IOException(file + ": " + error.getMessage(), error);
            }
        }
        Map<Field, String> texts = new EnumMap<>(Field.class);
        for (Field field : Field.values()) {
            texts.put(field, kept.getProperty(key(field), field.first));
        }
        return new Form(Shape.of(kept.getProperty(SHAPE, "")), texts);
    }

    void save(Form form) throws IOException {
        Properties kept = new Properties();
        kept.setProperty(SHAPE, form.shape.label);
        for (Field field : Field.values()) {
            kept.setProperty(key(field), form.text(field));
        }
        Files.createDirectories(file.getParent());
        Path fresh = Files.createTempFile(file.getParent(), "spy", ".new");
        try (Writer out = Files.newBufferedWriter(fresh)) {
            kept.store(out, "Leeway's dialog in lcm-spy: what was sent last");
        }
        Files.move(fresh, file, StandardCopyOption.REPLACE_EXISTING);
    }

    private static String key(Field field) {
        return field.label.replace(' ', '_');
    }
}
