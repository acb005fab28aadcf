// SPDX-License-Identifier: BSD-3-Clause
// Tests of telling a world: what is rebuilt from the messages is the world again, in as few of them as there can be.
//
// Units    metres, ns.
// Frames   base frame.
// Arrays   none.
// Memory   static: a world is large.
// Errors   cmocka's.
#include "bus/wire.h" // lw_wire_encode
#include "controller/tell.h"
#include "helpers.h"
#include "world_changes.h" // ball, change, apply

static struct lw_tell tell;
static struct lw_world rebuilt;

// Sends a message over the wire to who rebuilds the world: each owner a sender.
static void send(const struct lw_obstacle_change *change, int64_t seq)
{
    unsigned char data[LW_WIRE_MAX];
    union lw_message m = {.obstacles = *change};
    const enum lw_channel channel = change->vertex_count > 0 ? LW_CHANNEL_WORLD_HULL : LW_CHANNEL_WORLD;
    m.stamp = (struct lw_stamp){.session = change->owner, .seq = seq};
    assert_int_equal(lw_wire_decode(channel, data, lw_wire_encode(channel, &m, data), &m), LW_OK);
    assert_int_equal(m.obstacles.owner, change->owner);
    assert_int_equal(lw_world_apply(&rebuilt, &m.obstacles), LW_OK);
}

// Tells everything; returns the number of messages.
static int tell_all(const struct lw_world *world, int64_t now_ns)
{
    struct lw_obstacle_change change;
    int n = 0;
    memset(&rebuilt, 0, sizeof rebuilt);
    lw_tell_begin(&tell, world, now_ns);
    while (lw_tell_next(&tell, world, &change)) {
        assert_true(change.op == LW_UPSERT && change.count >= 1 && change.count <= LW_CHANGE_MAX);
        send(&change, ++n);
    }
    return n;
}

static void assert_rebuilt(const struct lw_world *world)
{
    assert_int_equal(rebuilt.count, world->count);
    assert_int_equal(rebuilt.digest, world->digest);
    for (int at = 0; at < world->count; at++)
        assert_int_equal(owner_of(&rebuilt, world->entry[at].obstacle.id), world->owner[at]);
}

// Any world: obstacles of all shapes and of several owners, at several times.
static void a_world_is_rebuilt_from_what_is_told(void **state)
{
    (void)state;
    struct random random = {51};
    struct lw_world *world = empty_world();
    for (int seq = 1; seq <= 400; seq++) {
        const int64_t session = 1 + random_below(&random, 5);
        struct lw_obstacle_change c = hull(session, seq, 1 + random_below(&random, 99), 1 + random_below(&random, 64));
        if (random_below(&random, 4) != 0) {
            c.vertex_count = 0;
            c.count = 1 + random_below(&random, LW_CHANGE_MAX);
            for (int i = 0; i < c.count; i++)
                c.obstacle[i] = any_solid(&random, 100 + (seq * 7 + i) % 900);
        }
        c.time_ns = random_below(&random, 2) * (1000 + random_below(&random, 3));
        c.valid_for_ms = c.time_ns > 0 ? random_below(&random, 3) : 0;
        assert_int_equal(lw_world_apply(world, &c), LW_OK);
        if (seq % 40 == 0) {
            (void)tell_all(world, 0);
            assert_rebuilt(world);
        }
    }
    assert_true(world->count > 500);
}

// Full messages: 10,000 balls of one source take 313.
static void messages_are_full(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    assert_int_equal(tell_all(world, 0), 0);
    for (int id = 1; id <= LW_WORLD_MAX; id += 2)
        apply(world, MINE, LW_UPSERT, ball(id, 1), ball(id + 1, 2));
    assert_int_equal(tell_all(world, 0), (LW_WORLD_MAX + LW_CHANGE_MAX - 1) / LW_CHANGE_MAX);
    assert_rebuilt(world);
    const struct lw_obstacle_change c = hull(MINE, 1, 5, 9); // in the place of a ball
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    assert_int_equal(tell_all(world, 0), 1 + (LW_WORLD_MAX - 1 + LW_CHANGE_MAX - 1) / LW_CHANGE_MAX);
    assert_rebuilt(world);
}

static void what_has_expired_is_not_told(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    struct lw_obstacle_change c = change(MINE, 1, LW_UPSERT, ball(1, 1), none);
    c.time_ns = 5;
    c.valid_for_ms = 1;
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    apply(world, YOURS, LW_UPSERT, ball(2, 1), none);
    assert_int_equal(tell_all(world, 1000004), 2);
    assert_int_equal(tell_all(world, 1000005), 1);
    assert_int_equal(rebuilt.count, 1);
    assert_int_equal(get(&rebuilt, 2).id, 2);
}

// The world may change while it is told: what has gone is left out, and the rest is told as it is now.
static void a_world_may_change_while_it_is_told(void **state)
{
    (void)state;
    struct random random = {52};
    struct lw_obstacle_change told;
    for (int round = 0; round < 50; round++) {
        struct lw_world *world = empty_world();
        int n = 0;
        memset(&rebuilt, 0, sizeof rebuilt);
        for (int id = 1; id <= 400; id += 2)
            apply(world, 1 + id % 3, LW_UPSERT, ball(id, 1), ball(id + 1, 2));
        lw_tell_begin(&tell, world, 0);
        while (lw_tell_next(&tell, world, &told)) {
            send(&told, ++n);
            for (int i = 0; i < told.count; i++) {
                const struct lw_obstacle now = get(world, told.obstacle[i].id);
                assert_same_bits(&told.obstacle[i], &now, sizeof now);
                assert_int_equal(told.owner, owner_of(world, now.id));
            }
            const int id = 1 + random_below(&random, 400);
            struct lw_obstacle_change c = hull(YOURS, n, id, 8);
            if (random_below(&random, 2))
                c = change(YOURS, 1000 + n, LW_REMOVE, ball(id, 0), none);
            assert_int_equal(lw_world_apply(world, &c), LW_OK);
        }
        assert_true(n >= 13 && rebuilt.count > 380);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_world_is_rebuilt_from_what_is_told),
        cmocka_unit_test(messages_are_full),
        cmocka_unit_test(what_has_expired_is_not_told),
        cmocka_unit_test(a_world_may_change_while_it_is_told),
    };
    return cmocka_run_group_tests_name("tell", tests, NULL, NULL);
}
