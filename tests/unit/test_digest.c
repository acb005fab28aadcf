// SPDX-License-Identifier: BSD-3-Clause
// Tests of the digests of a tick's input and of a world: one bit of any field makes another, and nothing else does.
//
// Units    metres, radians; ns where a name says so.
// Frames   base frame.
// Arrays   none.
// Memory   static.
// Errors   cmocka's.
#include "base/digest.h"
#include "collision/world.h" // lw_world_apply
#include "tick_rig.h"        // start
#include "world_changes.h"   // ball, change, apply

// All that a tick is given, in one piece, so that each of its bits can be changed.
struct input {
    int64_t time_ns, state_age_ns;
    struct lw_joint_state joint;
    struct lw_snapshot world;
    struct lw_request request;
    bool warming_up;
};

// Digest of an input, from the same past each time.
static int64_t digest_of(const struct rig *rig, const struct input *input)
{
    struct lw_controller_state past = rig->state;
    struct lw_joint_command out;
    const struct lw_tick_input in = {.time_ns = input->time_ns,
                                     .state_age_ns = input->state_age_ns,
                                     .warming_up = input->warming_up,
                                     .joint = &input->joint,
                                     .world = &input->world,
                                     .request = &input->request};
    lw_tick(&rig->config, &past, &in, &out);
    return out.input_digest;
}

static struct input *make_input(struct rig *rig)
{
    static struct input input;
    static struct lw_world world;
    memset(&world, 0, sizeof world);
    input.time_ns = INT64_C(123456789012);
    input.state_age_ns = 3456;
    input.joint = rig->joint;
    input.warming_up = false;
    input.joint.qd[2] = 0.5;
    const struct lw_obstacle_change change = {
        .stamp = {1, 2, 3, 4},
        .count = 2,
        .obstacle = {{.id = 33, .p = {-0.35, -0.5, 0.36}, .quat = {1}, .radius = 0.08},
                     {.id = 34, .p = {0.5, 0.5, 0.5}, .quat = {1}, .radius = 0}}};
    assert_int_equal(lw_world_apply(&world, &change), LW_OK);
    assert_int_equal(lw_world_build(&world, &input.world), LW_OK);
    input.request = (struct lw_request){.stamp = {11, 12, 5, 6}, .kind = LW_REQUEST_GOAL, .goal = {0.3, -0.5, 0.3}};
    return &input;
}

// Flips every bit of a field, one at a time.
static void check_every_bit(const struct rig *rig, struct input *input, void *field, size_t size)
{
    const int64_t digest = digest_of(rig, input);
    unsigned char *bytes = field;
    for (size_t bit = 0; bit < 8 * size; bit++) {
        bytes[bit / 8] = (unsigned char)(bytes[bit / 8] ^ (1u << (bit % 8)));
        assert_int_not_equal(digest_of(rig, input), digest);
        bytes[bit / 8] = (unsigned char)(bytes[bit / 8] ^ (1u << (bit % 8)));
    }
    assert_int_equal(digest_of(rig, input), digest);
}

#define CHECK_EVERY_BIT(field) check_every_bit(rig, input, &(field), sizeof(field))

static void every_bit_of_the_input_counts(void **state)
{
    (void)state;
    struct rig *rig = start();
    struct input *input = make_input(rig);
    CHECK_EVERY_BIT(input->time_ns);
    CHECK_EVERY_BIT(input->state_age_ns);
    CHECK_EVERY_BIT(input->joint.stamp); // four numbers without gaps
    CHECK_EVERY_BIT(input->joint.mode);
    CHECK_EVERY_BIT(input->joint.command_session);
    CHECK_EVERY_BIT(input->joint.command_seq);
    CHECK_EVERY_BIT(input->joint.tick);
    CHECK_EVERY_BIT(input->joint.period_ns);
    CHECK_EVERY_BIT(input->joint.q);
    CHECK_EVERY_BIT(input->joint.qd);
    CHECK_EVERY_BIT(input->world.version);
    CHECK_EVERY_BIT(input->world.last_channel);
    CHECK_EVERY_BIT(input->world.last.session);
    CHECK_EVERY_BIT(input->world.last.seq);
    CHECK_EVERY_BIT(input->world.digest);
    CHECK_EVERY_BIT(input->request.stamp.session);
    CHECK_EVERY_BIT(input->request.stamp.seq);
    CHECK_EVERY_BIT(input->request.kind);
    CHECK_EVERY_BIT(input->request.goal);
    const int64_t digest = digest_of(rig, input);
    input->warming_up = true;
    assert_int_not_equal(digest_of(rig, input), digest);
}

// The same input has the same digest wherever it stands in memory and whatever the controller did before.
// A value of the scene counts even where it moves nothing.
static void the_scene_counts(void **state)
{
    (void)state;
    struct rig *rig = start();
    struct input *input = make_input(rig);
    const int64_t digest = digest_of(rig, input);
    struct lw_scene scene = rig->scene;
    scene.duration_s = nextafter(scene.duration_s, HUGE_VAL);
    assert_int_equal(lw_controller_init(&rig->config, &rig->state, &scene, rig->config.session), LW_OK);
    assert_int_not_equal(digest_of(rig, input), digest);
    assert_int_equal(lw_controller_init(&rig->config, &rig->state, &rig->scene, rig->config.session), LW_OK);
    assert_int_equal(digest_of(rig, input), digest);
}

static void equal_inputs_have_equal_digests(void **state)
{
    (void)state;
    struct rig *rig = start();
    static struct input copy;
    struct input *input = make_input(rig);
    const int64_t digest = digest_of(rig, input);
    memset(&copy, 0x5a, sizeof copy);
    copy = *input;
    assert_int_equal(digest_of(rig, &copy), digest);
    go_for(rig, 50); // another velocity, another tick
    assert_true(speed(rig) > 0);
    assert_int_equal(digest_of(rig, input), digest);
}

// The request counts that is in force, whether it comes again or not.
static void the_request_in_force_counts(void **state)
{
    (void)state;
    struct rig *rig = start();
    struct input *input = make_input(rig);
    const int64_t digest = digest_of(rig, input);
    rig->request = input->request;
    go(rig); // obeyed
    assert_int_equal(digest_of(rig, input), digest);
    input->request.goal[0] = 99; // a repetition that was changed on the way is not obeyed
    assert_int_equal(digest_of(rig, input), digest);
    input->request = (struct lw_request){0};
    assert_int_equal(digest_of(rig, input), digest);
}

// Two digests that are equal in all but one bit of a word differ, at any place of the word in the row.
static void a_changed_bit_is_never_lost(void **state)
{
    (void)state;
    struct random random = {77};
    for (int n = 0; n < 2000; n++) {
        uint64_t words[8], a = LW_DIGEST_START, b = LW_DIGEST_START;
        const int at = random_below(&random, 8), bit = random_below(&random, 64);
        for (int i = 0; i < 8; i++) {
            words[i] = random_bits(&random);
            a = lw_digest_word(a, words[i]);
            b = lw_digest_word(b, i == at ? words[i] ^ (UINT64_C(1) << bit) : words[i]);
        }
        assert_true(a != b);
    }
    const double zeros[2] = {0.0, -0.0};
    assert_true(lw_digest_doubles(1, &zeros[0], 1) != lw_digest_doubles(1, &zeros[1], 1));
    assert_true(lw_digest_doubles(1, zeros, 0) == 1);
    // Order counts, and so does a zero more.
    assert_true(lw_digest_int(lw_digest_int(1, 2), 3) != lw_digest_int(lw_digest_int(1, 3), 2));
    assert_true(lw_digest_int(LW_DIGEST_START, 0) != LW_DIGEST_START);
}

// --- the world ---

static int64_t digest_of_change(const struct lw_obstacle_change *c)
{
    struct lw_world *world = empty_world();
    assert_int_equal(lw_world_apply(world, c), LW_OK);
    return world->digest;
}

// One bit of any value of an obstacle, of its times or of a vertex makes another digest.
static void every_bit_of_an_obstacle_counts(void **state)
{
    (void)state;
    struct lw_obstacle_change c = hull(MINE, 1, 5, 3);
    struct lw_obstacle *o = &c.obstacle[0];
    c.time_ns = INT64_C(123456789);
    c.valid_for_ms = 5;
    const struct {
        void *field;
        size_t size;
    } fields[] = {{&o->id, sizeof o->id},      {o->p, sizeof o->p},
                  {o->quat, sizeof o->quat},   {&o->radius, sizeof o->radius},
                  {o->size, sizeof o->size},   {o->v, sizeof o->v},
                  {o->omega, sizeof o->omega}, {&c.time_ns, sizeof c.time_ns},
                  {&c.valid_for_ms, 2},        {c.vertex, 9 * sizeof c.vertex[0]}};
    const int64_t digest = digest_of_change(&c);
    for (size_t f = 0; f < sizeof fields / sizeof fields[0]; f++)
        for (size_t bit = 0; bit < 8 * fields[f].size; bit++) {
            unsigned char *byte = (unsigned char *)fields[f].field + bit / 8;
            *byte = (unsigned char)(*byte ^ (1u << (bit % 8)));
            assert_int_not_equal(digest_of_change(&c), digest);
            *byte = (unsigned char)(*byte ^ (1u << (bit % 8)));
        }
    assert_int_equal(digest_of_change(&c), digest);
    c.vertex_count = 4; // one more at the origin
    assert_int_not_equal(digest_of_change(&c), digest);
    const struct lw_obstacle_change solid = change(MINE, 1, LW_UPSERT, ball(5, 1), none);
    struct lw_obstacle_change other = solid;
    other.obstacle[0].shape = LW_CAPSULE;
    assert_int_not_equal(digest_of_change(&solid), digest_of_change(&other));
}

// The digest is that of the set, however the world came to it and whoever sent it; what changes nothing keeps it.
static void the_digest_is_that_of_the_set(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    apply(world, MINE, LW_UPSERT, ball(1, 0.1), ball(2, 0.2));
    const int64_t digest = world->digest;
    apply(world, YOURS, LW_UPSERT, ball(3, 0.3), none);
    assert_int_not_equal(world->digest, digest);
    apply(world, YOURS, LW_REMOVE, ball(3, 0), none);
    assert_int_equal(world->digest, digest);
    apply(world, YOURS, LW_REPLACE, ball(1, 0.1), none);
    assert_int_equal(world->digest, digest);
    apply(world, MINE, LW_UPSERT, ball(2, 0.7), none);
    assert_int_not_equal(world->digest, digest);
    apply(world, MINE, LW_UPSERT, ball(2, 0.2), none);
    assert_int_equal(world->digest, digest);
    // No obstacle, one that was heard of and one at the origin are three different things.
    apply(world, MINE, LW_CLEAR, none, none);
    assert_int_equal(world->digest, 0);
    apply(world, MINE, LW_UPSERT, (struct lw_obstacle){.id = 1}, none);
    assert_int_not_equal(world->digest, 0);
    // The order in which they came is no part of it.
    apply(world, MINE, LW_REPLACE, ball(2, 0.2), none);
    apply(world, MINE, LW_UPSERT, ball(1, 0.1), none);
    assert_int_equal(world->digest, digest);
}

// A change that is refused leaves the digest too, and so does one that comes again.
static void a_refused_change_keeps_the_digest(void **state)
{
    (void)state;
    struct lw_world *world = empty_world();
    apply(world, MINE, LW_UPSERT, ball(1, 0.1), none);
    apply(world, MINE, LW_UPSERT, ball(1, 0.2), none);
    const int64_t digest = world->digest;
    struct lw_obstacle_change c = change(MINE, 1, LW_CLEAR, none, none);
    assert_int_equal(lw_world_apply(world, &c), LW_E_OLD);
    c.stamp.seq = 2;
    assert_int_equal(lw_world_apply(world, &c), LW_OK);
    assert_int_equal(world->digest, digest);
}

// --- a step ---

// Each step can be undone, so nothing is lost on the way; and the digest of old logs stays what it was.
static void a_step_can_be_undone(void **state)
{
    (void)state;
    struct random random = {78};
    for (int n = 0; n < 1000; n++) {
        const uint64_t before = random_bits(&random), word = random_bits(&random);
        const uint64_t after = lw_digest_word(before, word);
        const uint64_t unfolded = after ^ (after >> 32);
        const uint64_t inverse = UINT64_C(0xce965057aff6957b); // of 0x100000001b3, modulo 2^64
        assert_true(((unfolded * inverse) ^ word) == before);
    }
    const double values[2] = {1.5, -2.25};
    const uint64_t digest = lw_digest_doubles(lw_digest_int(LW_DIGEST_START, -7), values, 2);
    assert_true(digest == UINT64_C(0x206d7844397f435a));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_scene_counts),
        cmocka_unit_test(every_bit_of_the_input_counts),
        cmocka_unit_test(equal_inputs_have_equal_digests),
        cmocka_unit_test(the_request_in_force_counts),
        cmocka_unit_test(every_bit_of_an_obstacle_counts),
        cmocka_unit_test(the_digest_is_that_of_the_set),
        cmocka_unit_test(a_refused_change_keeps_the_digest),
        cmocka_unit_test(a_step_can_be_undone),
        cmocka_unit_test(a_changed_bit_is_never_lost),
    };
    return cmocka_run_group_tests_name("digest", tests, NULL, NULL);
}
