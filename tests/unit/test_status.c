// SPDX-License-Identifier: BSD-3-Clause
// Tests of the status codes: every code has a text of its own, and no number reads beyond them.
//
// Units    none.
// Frames   none.
// Arrays   none.
// Memory   none.
// Errors   cmocka's.
#include "base/status.h"
#include "helpers.h"

static const enum lw_status all[] = {
#define STATUS_NAME(name, text) name,
    LW_STATUS_LIST(STATUS_NAME)
#undef STATUS_NAME
};
enum { COUNT = sizeof all / sizeof all[0] };

// Success is 0, so that `if (status)` reads right.
static void ok_is_zero(void **state)
{
    (void)state;
    assert_int_equal(LW_OK, 0);
    assert_string_equal(lw_status_text(LW_OK), "ok");
}

// The text stands beside its code in the list, and no two codes share one.
static void every_code_has_its_own_text(void **state)
{
    (void)state;
#define STATUS_TEXT(name, text) assert_string_equal(lw_status_text(name), text);
    LW_STATUS_LIST(STATUS_TEXT)
#undef STATUS_TEXT
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < i; k++)
            assert_string_not_equal(lw_status_text(all[i]), lw_status_text(all[k]));
}

// A number that is no code gets a text too, never memory behind the table.
static void unknown_numbers_have_a_text(void **state)
{
    (void)state;
    const int numbers[] = {-1, COUNT, COUNT + 1, INT32_MAX, INT32_MIN};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        // NOLINTNEXTLINE(clang-analyzer-optin.core.EnumCastOutOfRange): that is the test
        assert_string_equal(lw_status_text((enum lw_status)numbers[i]), "unknown status");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ok_is_zero),
        cmocka_unit_test(every_code_has_its_own_text),
        cmocka_unit_test(unknown_numbers_have_a_text),
    };
    return cmocka_run_group_tests_name("status", tests, NULL, NULL);
}
