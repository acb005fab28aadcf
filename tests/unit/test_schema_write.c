// SPDX-License-Identifier: BSD-3-Clause
// Tests of writing by a schema: values read back to the same bits, the reference is complete.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   open_memstream's, freed here.
// Errors   cmocka's.
#define _GNU_SOURCE // open_memstream
#include "base/schema.h"
#include "helpers.h"
#include "schema_sample.h" // struct sample, accept

static char *written(const struct sample *s)
{
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    assert_non_null(to);
    lw_schema_write(sample_keys, s, to);
    assert_int_equal(fclose(to), 0);
    return text;
}

// Any values that can be read are written so that they read back to the same bits.
static void written_text_reads_back_to_the_same_bits(void **state)
{
    (void)state;
    struct random random = {21};
    for (int i = 0; i < 300; i++) {
        struct sample s = defaults();
        s.number = random_in(&random, -10, 10) * (random_below(&random, 2) ? 1 : 1e-300);
        s.integer = 1 + random_below(&random, 4);
        s.choice = random_below(&random, 3);
        random_fill(&random, -1e300, 1e300, s.vector, 3);
        s.vector[0] = -0.0;
        for (int j = 0; j < 2; j++)
            s.limits[j] = i % 2 ? random_in(&random, 1e-9, 1) / 3 : HUGE_VAL;
        s.inner = nextafter(random_in(&random, 0, 1), 2);
        s.count = random_below(&random, 4);
        for (int k = 0; k < s.count; k++) {
            s.item[k].id = random_below(&random, 10);
            random_fill(&random, -1, 1, s.item[k].at, 2);
        }
        char *text = written(&s);
        const struct sample back = accept(text);
        free(text);
        assert_same_bits(&back, &s, sizeof s);
    }
}

// A number is written as short as it can be: 0.1 is 0.1.
static void numbers_are_written_as_short_as_they_can_be(void **state)
{
    (void)state;
    struct sample s = defaults();
    s.number = 0.1;
    s.vector[0] = 1.0 / 3;
    s.vector[2] = 1e-300;
    char *text = written(&s);
    assert_string_equal(text, "number: 0.1\ninteger: 2\nchoice: red\nvector: [0.3333333333333333, -0.5, 1e-300]\n"
                              "limits: [3, 3]\nsection:\n  inner: 0.25\nitems: []\n");
    free(text);
}

// The reference mentions each key with what it accepts, its help and its default.
static void the_reference_mentions_every_key(void **state)
{
    (void)state;
    char *text = NULL;
    size_t size = 0;
    FILE *to = open_memstream(&text, &size);
    const struct sample s = defaults();
    lw_schema_describe(sample_keys, &s, to);
    assert_int_equal(fclose(to), 0);
    assert_string_equal(text, "number: a number >= -10 and <= 10\n    a number\n    required\n"
                              "integer: an integer >= 1 and <= 4\n    an integer\n    default 2\n"
                              "choice: one of red, green, blue\n    a colour\n    default red\n"
                              "vector: a list of 3 numbers\n    a vector\n    default [0, -0.5, 0]\n"
                              "limits: off, a number > 0, or a list of 2 of them\n    two limits\n    default [3, 3]\n"
                              "section: keys with values\n    a section\n"
                              "  inner: a number > 0 (m)\n      a number in a section\n      default 0.25\n"
                              "items: a list of at most 3 entries\n    a list\n"
                              "  id: an integer >= 0 and <= 9\n      number of an item\n      default 0\n"
                              "  at: a list of 2 numbers >= -1 and <= 1\n      place of an item\n      required\n");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(written_text_reads_back_to_the_same_bits),
        cmocka_unit_test(numbers_are_written_as_short_as_they_can_be),
        cmocka_unit_test(the_reference_mentions_every_key),
    };
    return cmocka_run_group_tests_name("schema_write", tests, NULL, NULL);
}
