// SPDX-License-Identifier: BSD-3-Clause
// Tests of reading by a schema: what it takes, what it refuses and in which words.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   stack.
// Errors   cmocka's.
#include "base/schema.h"
#include "helpers.h"
#include "schema_sample.h" // struct sample, read_with, accept

// --- refusal ---

// Refused with exactly these words, and nothing of the struct was touched.
static void refuse_with(const char *text, const char *const *set, int set_count, const char *words)
{
    const struct sample before = defaults();
    struct sample s = before;
    struct lw_error error = {""};
    assert_int_equal(read_with(text, set, set_count, &s, &error), LW_E_SCENE);
    assert_string_equal(error.text, words);
    assert_same_bits(&s, &before, sizeof s);
}

static void refuse(const char *text, const char *words)
{
    refuse_with(text, NULL, 0, words);
}

static void refuse_set(const char *set, const char *words)
{
    refuse_with("number: 1\nitems: [{at: [0, 0]}]\n", &set, 1, words);
}

// --- what is taken ---

static void every_kind_is_read(void **state)
{
    (void)state;
    const struct sample s =
        accept("number: -2.5e-1\ninteger: 3\nchoice: blue\nvector: [1, -.5, +2E2]\nlimits: [1, 2.5]\n"
               "section:\n  inner: 7\nitems:\n  - {id: 4, at: [0.5, -1]}\n  - at: [1, 0]\n");
    const double vector[3] = {1, -0.5, 200}, limits[2] = {1, 2.5}, at[2] = {0.5, -1};
    assert_near(s.number, -0.25, 0);
    assert_int_equal(s.integer, 3);
    assert_int_equal(s.choice, 2);
    assert_all_near(s.vector, vector, 3, 0);
    assert_all_near(s.limits, limits, 2, 0);
    assert_near(s.inner, 7, 0);
    assert_int_equal(s.count, 2);
    assert_int_equal(s.item[0].id, 4);
    assert_all_near(s.item[0].at, at, 2, 0);
    assert_int_equal(s.item[1].id, 0);
}

// A key that is left out keeps the value that stood in the struct.
static void what_is_left_out_stays(void **state)
{
    (void)state;
    const struct sample s = accept("# only what is required\nnumber: 4\n");
    struct sample expected = defaults();
    expected.number = 4;
    assert_same_bits(&s, &expected, sizeof s);
}

// Limits: off, one number for all joints, or one each.
static void limits_have_three_forms(void **state)
{
    (void)state;
    const struct sample off = accept("number: 1\nlimits: off"), one = accept("number: 1\nlimits: 5");
    assert_true(isinf(off.limits[0]) && isinf(off.limits[1]) && off.limits[0] > 0 && off.limits[1] > 0);
    assert_true(one.limits[0] == 5 && one.limits[1] == 5);
    const struct sample some = accept("number: 1\nlimits: [off, 5]");
    assert_true(isinf(some.limits[0]) && some.limits[1] == 5);
}

// Both ends of a range belong to it; an open end does not.
static void ranges_end_where_they_say(void **state)
{
    (void)state;
    assert_near(accept("number: 10").number, 10, 0);
    assert_near(accept("number: -10").number, -10, 0);
    assert_near(accept("number: 1\nsection: {inner: 1e-300}").inner, 1e-300, 0);
    refuse("number: 10.000000000000002",
           "f.yaml:1: number: expected a number >= -10 and <= 10, found \"10.000000000000002\"");
    refuse("number: -10.000000000000002",
           "f.yaml:1: number: expected a number >= -10 and <= 10, found \"-10.000000000000002\"");
    refuse("number: 1\nsection: {inner: 0}", "f.yaml:2: section.inner: expected a number > 0 (m), found \"0\"");
    refuse("number: 1\ninteger: 0", "f.yaml:2: integer: expected an integer >= 1 and <= 4, found \"0\"");
    refuse("number: 1\ninteger: 5", "f.yaml:2: integer: expected an integer >= 1 and <= 4, found \"5\"");
    refuse("number: 1\nlimits: [1, 0]",
           "f.yaml:2: limits: expected off, a number > 0, or a list of 2 of them, found \"0\"");
}

// --- what is refused ---

// Only finite decimal numbers are numbers.
static void odd_numbers_are_refused(void **state)
{
    (void)state;
    static const char *const odd[] = {"nan",   ".nan", "NaN", "inf", ".inf", "-.inf",    "0x10", "0x1", "0x1p3",
                                      "1e400", "1e",   "e5",  "--1", "1..2", "1 2",      "1,5",  "1_0", "true",
                                      "~",     "null", "1m",  ".",   "+",    "infinity", "1e5.5"};
    for (size_t i = 0; i < sizeof odd / sizeof odd[0]; i++) {
        char text[64], words[160];
        snprintf(text, sizeof text, "\n\nnumber: %s", odd[i]);
        snprintf(words, sizeof words, "f.yaml:3: number: expected a number >= -10 and <= 10, found \"%s\"", odd[i]);
        refuse(text, words);
    }
    refuse("number:\n", "f.yaml:1: number: expected a number >= -10 and <= 10, found \"\"");
    refuse("number: ''\n", "f.yaml:1: number: expected a number >= -10 and <= 10, found \"\"");
    refuse("number: 1\nvector: [0, 1e400, 0]\n", "f.yaml:2: vector: expected a list of 3 numbers, found \"1e400\"");
    refuse("number: 1\ninteger: 2.5\n", "f.yaml:2: integer: expected an integer >= 1 and <= 4, found \"2.5\"");
}

static void wrong_types_are_refused(void **state)
{
    (void)state;
    refuse("number: [1]", "f.yaml:1: number: expected a number >= -10 and <= 10, found a list of 1");
    refuse("number: {a: 1}", "f.yaml:1: number: expected a number >= -10 and <= 10, found a mapping");
    refuse("number: 1\nchoice: Red", "f.yaml:2: choice: expected one of red, green, blue, found \"Red\"");
    refuse("number: 1\nchoice: [red]", "f.yaml:2: choice: expected one of red, green, blue, found a list of 1");
    refuse("number: 1\nvector: 5", "f.yaml:2: vector: expected a list of 3 numbers, found \"5\"");
    refuse("number: 1\nsection: 5", "f.yaml:2: section: expected keys with values, found \"5\"");
    refuse("number: 1\nsection: [1]", "f.yaml:2: section: expected keys with values, found a list of 1");
    refuse("number: 1\nitems: 5", "f.yaml:2: items: expected a list of at most 3 entries, found \"5\"");
    refuse("number: 1\nitems: {id: 1}", "f.yaml:2: items: expected a list of at most 3 entries, found a mapping");
    refuse("number: 1\nitems: [5]", "f.yaml:2: items.0: expected keys with values, found \"5\"");
    refuse("[1, 2]", "f.yaml:1: expected keys with values, found a list of 2");
    refuse("number", "f.yaml:1: expected keys with values, found \"number\"");
}

// A list of the wrong length is named by its length, one of the right length by its first wrong entry.
static void lists_of_the_wrong_length_are_refused(void **state)
{
    (void)state;
    refuse("number: 1\nvector: [1, 2]", "f.yaml:2: vector: expected a list of 3 numbers, found a list of 2");
    refuse("number: 1\nvector: [1, 2, 3, 4]", "f.yaml:2: vector: expected a list of 3 numbers, found a list of 4");
    refuse("number: 1\nvector: [1, x, y]", "f.yaml:2: vector: expected a list of 3 numbers, found \"x\"");
    refuse("number: 1\nvector: [1, [2], 3]", "f.yaml:2: vector: expected a list of 3 numbers, found a list of 1");
    refuse("number: 1\nlimits: [1]",
           "f.yaml:2: limits: expected off, a number > 0, or a list of 2 of them, found a list of 1");
    refuse("number: 1\nitems: [{at: [0, 0]}, {at: [0, 0]}, {at: [0, 0]}, {at: [0, 0]}]",
           "f.yaml:2: items: expected a list of at most 3 entries, found a list of 4");
}

static void keys_are_checked(void **state)
{
    (void)state;
    refuse("number: 1\n\n# why\nnumbre: 2\n",
           "f.yaml:4: numbre: unknown key; known here: number, integer, choice, vector, limits, section, items");
    refuse("number: 1\nsection:\n  innre: 2\n", "f.yaml:3: section.innre: unknown key; known here: inner");
    refuse("number: 1\nitems:\n  - at: [0, 0]\n  - at: [0, 0]\n    di: 3\n",
           "f.yaml:5: items.1.di: unknown key; known here: id, at");
    refuse("number: 1\ninteger: 2\nnumber: 3\n", "f.yaml:3: number: key stands twice");
    refuse("number: 1\nsection: {inner: 1, inner: 1}\n", "f.yaml:2: section.inner: key stands twice");
    refuse("number: 1\n[1]: 2\n",
           "f.yaml:2: ?: unknown key; known here: number, integer, choice, vector, limits, section, items");
}

static void missing_keys_are_named_with_what_they_accept(void **state)
{
    (void)state;
    refuse("", "f.yaml:1: number: missing key: expected a number >= -10 and <= 10");
    refuse("# a comment\n\ninteger: 2\n", "f.yaml:3: number: missing key: expected a number >= -10 and <= 10");
    refuse("number: 1\nitems:\n  - at: [0, 0]\n  - id: 3\n",
           "f.yaml:4: items.1.at: missing key: expected a list of 2 numbers >= -1 and <= 1");
}

// What is not YAML at all is refused with its line.
static void broken_yaml_is_refused_with_its_line(void **state)
{
    (void)state;
    static const struct {
        const char *text, *where;
    } broken[] = {{"number: 1\nvector: [1, 2\ninteger: 2\n", "f.yaml:3: not YAML: "},
                  {"number: 1\n\tinteger: 2\n", "f.yaml:2: not YAML: "},
                  {"number: \"1\n", "f.yaml:2: not YAML: "},
                  {"number: 1\nchoice: *nobody\n", "f.yaml:2: not YAML: "},
                  {"number: 1\n---\nnumber: 2\n", "f.yaml:2: expected one YAML document"},
                  {"number: 1\n...\n\"", "f.yaml:3: not YAML: "}};
    for (size_t i = 0; i < sizeof broken / sizeof broken[0]; i++) {
        struct sample s = defaults();
        const struct sample before = s;
        struct lw_error error = {""};
        assert_int_equal(read_with(broken[i].text, NULL, 0, &s, &error), LW_E_SCENE);
        assert_memory_equal(error.text, broken[i].where, strlen(broken[i].where));
        assert_same_bits(&s, &before, sizeof s);
    }
}

// A text that would keep libyaml busy for minutes is refused as soon as its shape shows: 1 MB of brackets.
static void texts_of_excessive_shape_are_refused_at_once(void **state)
{
    (void)state;
    static const struct {
        const char *part;
        int times;
        const char *words;
    } cases[] = {{"[", 1000000, "f.yaml:1: expected lists and mappings at most 16 deep"},
                 {"{a: ", 250000, "f.yaml:1: expected lists and mappings at most 16 deep"},
                 {"- &a b\n", 20000, "f.yaml:20000: expected at most 20000 values"},
                 {"- b\n", 19999, "f.yaml:1: expected keys with values, found a list of 19999"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const size_t length = strlen(cases[i].part), size = length * (size_t)cases[i].times;
        char *text = calloc(1, size + 1);
        assert_non_null(text);
        for (size_t at = 0; at < size; at += length)
            memcpy(text + at, cases[i].part, length);
        refuse(text, cases[i].words);
        free(text);
    }
}

// --- overrides ---

// An override replaces what the file says, or adds what it lacks; of two the later one counts.
static void overrides_replace_and_add(void **state)
{
    (void)state;
    static const char *const set[] = {"number=2",         "number=3",     "section.inner=9",   "limits=off",
                                      "vector=[3, 2, 1]", "items.1.id=8", "items.0.at=[1, 1]", "choice=green"};
    const struct sample s = accept_with("number: 1\nlimits: 5\nitems: [{id: 1, at: [0, 0]}, {at: [0, 0]}]\n", set, 8);
    const double vector[3] = {3, 2, 1}, ones[2] = {1, 1};
    assert_near(s.number, 3, 0);
    assert_near(s.inner, 9, 0);
    assert_true(isinf(s.limits[0]));
    assert_all_near(s.vector, vector, 3, 0);
    assert_int_equal(s.item[1].id, 8);
    assert_int_equal(s.item[0].id, 1);
    assert_all_near(s.item[0].at, ones, 2, 0);
    assert_int_equal(s.choice, 1);
}

// A whole list and a whole section can be replaced; an override of a member still has its say inside.
static void overrides_replace_whole_lists_and_sections(void **state)
{
    (void)state;
    static const char *const set[] = {"items=[{at: [1, 0]}, {id: 5, at: [0, 1]}, {at: [0, 0]}]", "items.2.id=7",
                                      "section={inner: 3}"};
    const struct sample s = accept_with("number: 1\nitems: [{id: 1, at: [0, 0]}]\nsection: {inner: 2}\n", set, 3);
    assert_int_equal(s.count, 3);
    assert_int_equal(s.item[0].id, 0);
    assert_int_equal(s.item[1].id, 5);
    assert_int_equal(s.item[2].id, 7);
    assert_near(s.item[1].at[1], 1, 0);
    assert_near(s.inner, 3, 0);
    static const char *const none[] = {"items=[]"};
    assert_int_equal(accept_with("number: 1\nitems: [{at: [0, 0]}]\n", none, 1).count, 0);
}

// A required key may come from an override alone.
static void overrides_satisfy_required_keys(void **state)
{
    (void)state;
    static const char *const set[] = {"number=2", "items=[{}]", "items.0.at=[1, 1]"};
    const struct sample s = accept_with("integer: 3\n", set, 3);
    assert_near(s.number, 2, 0);
    assert_near(s.item[0].at[1], 1, 0);
}

static void bad_overrides_are_refused(void **state)
{
    (void)state;
    refuse_set("nubmer=2", "--set nubmer=2: unknown key; `leeway keys` lists all of them");
    refuse_set("number", "--set number: expected KEY=VALUE, as in --set law.gamma=2");
    refuse_set("numbe=2", "--set numbe=2: unknown key; `leeway keys` lists all of them");
    refuse_set("=2", "--set =2: unknown key; `leeway keys` lists all of them");
    refuse_set("items.1.id=2", "--set items.1.id=2: unknown key; `leeway keys` lists all of them");
    refuse_set("number=11", "--set number=11: number: expected a number >= -10 and <= 10, found \"11\"");
    refuse_set("number=", "--set number=: number: expected a number >= -10 and <= 10, found nothing");
    refuse_set("items.0.at=[0, 2]",
               "--set items.0.at=[0, 2]: items.0.at: expected a list of 2 numbers >= -1 and <= 1, found \"2\"");
    refuse_set("section=", "--set section=: section: expected keys with values, found nothing");
    refuse_set("items=[{}]", "--set items=[{}]: items.0.at: missing key: expected a list of 2 numbers >= -1 and <= 1");
    refuse_set("section={x: 1}", "--set section={x: 1}: section.x: unknown key; known here: inner");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_is_read),
        cmocka_unit_test(what_is_left_out_stays),
        cmocka_unit_test(limits_have_three_forms),
        cmocka_unit_test(ranges_end_where_they_say),
        cmocka_unit_test(odd_numbers_are_refused),
        cmocka_unit_test(wrong_types_are_refused),
        cmocka_unit_test(lists_of_the_wrong_length_are_refused),
        cmocka_unit_test(keys_are_checked),
        cmocka_unit_test(missing_keys_are_named_with_what_they_accept),
        cmocka_unit_test(broken_yaml_is_refused_with_its_line),
        cmocka_unit_test(texts_of_excessive_shape_are_refused_at_once),
        cmocka_unit_test(overrides_replace_and_add),
        cmocka_unit_test(overrides_replace_whole_lists_and_sections),
        cmocka_unit_test(overrides_satisfy_required_keys),
        cmocka_unit_test(bad_overrides_are_refused),
    };
    return cmocka_run_group_tests_name("schema", tests, NULL, NULL);
}
