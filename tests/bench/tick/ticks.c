// SPDX-License-Identifier: BSD-3-Clause
// How long a whole tick takes: the paper's cases with capsules, and an arm that moves among many mixed obstacles.
// Prints JSON; `./dev bench tick` runs it. Times are of this thread's own processor time, so that others on the machine
// count less.
//
// Units    ns in the output.
// Frames   base frame.
// Arrays   one entry a joint.
// Memory   static.
// Errors   exit status 1 with a message when a scene is refused.
#define _GNU_SOURCE // clock_gettime
#include "controller/tick.h"
#include "simulator/plant.h"

#include <math.h>   // sin
#include <stdio.h>  // printf
#include <stdlib.h> // qsort
#include <string.h> // memcpy
#include <time.h>   // clock_gettime

enum { TICKS = 20000, PAPER_TICKS = 1000, WARM_UP = 200 };

static struct lw_controller config;
static struct lw_controller_state state;
static struct lw_snapshot world;
static int64_t duration_ns[TICKS];

static int64_t own_time_ns(void)
{
    struct timespec t;
    (void)clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec * INT64_C(1000000000) + t.tv_nsec;
}

static int by_size(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

// Time of two looks at the clock with nothing in between.
static int64_t clock_cost_ns(void)
{
    int64_t least = INT64_MAX;
    for (int i = 0; i < 10000; i++) {
        const int64_t start = own_time_ns(), cost = own_time_ns() - start;
        least = cost < least ? cost : least;
    }
    return least;
}

static void print_times(const char *name, int count, double near, const char *more)
{
    qsort(duration_ns, (size_t)count, sizeof duration_ns[0], by_size);
    const int64_t clock_ns = clock_cost_ns();
    printf("%s  \"%s\": {\"n\": %d, \"near\": %.2f, \"p50\": %lld, \"p99\": %lld, \"p999\": %lld, \"max\": %lld}", more,
           name, count, near, (long long)(duration_ns[count / 2] - clock_ns),
           (long long)(duration_ns[count * 99 / 100] - clock_ns),
           (long long)(duration_ns[count * 999 / 1000] - clock_ns), (long long)(duration_ns[count - 1] - clock_ns));
}

// One timed tick at a configuration.
static void timed_tick(int64_t k, const double q[LW_NJ], struct lw_joint_command *command, int64_t *took_ns)
{
    static const struct lw_request no_request;
    struct lw_joint_state joint = {.stamp = {.session = 1, .seq = k + 1},
                                   .mode = LW_PLANT_MOVING,
                                   .command_session = config.session,
                                   .tick = k,
                                   .period_ns = config.period_ns};
    memcpy(joint.q, q, sizeof joint.q);
    const struct lw_tick_input in = {
        .time_ns = k * config.period_ns, .joint = &joint, .world = &world, .request = &no_request};
    const int64_t start_ns = own_time_ns();
    lw_tick(&config, &state, &in, command);
    *took_ns = own_time_ns() - start_ns;
}

static bool load(const char *path, const char *const *set, int sets, struct lw_scene *scene)
{
    struct lw_error error;
    if (lw_scene_load(path, set, sets, scene, &error) == LW_OK &&
        lw_controller_init(&config, &state, scene, 2) == LW_OK)
        return true;
    fprintf(stderr, "bench_ticks: %s\n", error.text);
    return false;
}

// Drives the arm as commanded, from the start of the scene on.
static void drive(const struct lw_scene *scene, int64_t duration[PAPER_TICKS])
{
    double q[LW_NJ];
    memcpy(q, scene->q0, sizeof q);
    for (int64_t k = 0; k < PAPER_TICKS; k++) {
        struct lw_joint_command command;
        timed_tick(k, q, &command, &duration[k]);
        for (int j = 0; j < LW_NJ; j++)
            q[j] += 0.008 * command.qd[j];
    }
}

// A case of the paper, with capsules, again and again: one time is a few hundred microseconds of this machine.
static bool paper_case(const char *name, const char *path, const char *more)
{
    static const char *const set[] = {"law.control_points=capsules"};
    static struct lw_scene scene;
    if (!load(path, set, 1, &scene))
        return false;
    const struct lw_solid point = {.kind = LW_SPHERE};
    const struct lw_pose pose = {.r = {1, 0, 0, 0, 1, 0, 0, 0, 1}, .p = {1, 1, 0.4}};
    lw_snapshot_begin(&world);
    if (lw_snapshot_add(&world, 1, 1, &point, &pose, NULL) != LW_OK)
        return false;
    lw_snapshot_end(&world);
    world.version = 1;
    for (int k = 0; k < TICKS; k += PAPER_TICKS)
        drive(&scene, &duration_ns[k]);
    print_times(name, TICKS, 1, more);
    return true;
}

// --- many obstacles ---

static uint64_t seed = 88172645463325252u;

static double random_in(double low, double high)
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return low + (high - low) * (double)(seed >> 11) / 9007199254740992.0;
}

// Half hulls of 8 to 64 vertices, a fifth boxes, a tenth capsules, a fifth spheres, 2 to 12 cm in size.
static struct lw_solid random_solid(double vertex[3 * LW_HULL_MAX])
{
    const double kind = random_in(0, 1), size = random_in(0.01, 0.06);
    struct lw_solid solid = {.kind = kind < 0.5   ? LW_HULL
                                     : kind < 0.7 ? LW_BOX
                                     : kind < 0.8 ? LW_CAPSULE
                                                  : LW_SPHERE,
                             .vertex = vertex,
                             .count = (int)random_in(8, 64.999)};
    solid.radius = solid.kind == LW_SPHERE ? size : solid.kind == LW_CAPSULE ? size / 2 : 0;
    solid.half_length = size / 2;
    for (int i = 0; i < 3; i++)
        solid.half[i] = size * random_in(0.4, 0.57);
    for (int i = 0; i < solid.count; i++) {
        double *v = &vertex[3 * i], length = 0;
        for (int k = 0; k < 3; k++) {
            v[k] = random_in(-1, 1);
            length += v[k] * v[k];
        }
        for (int k = 0; k < 3; k++)
            v[k] *= size / sqrt(length);
    }
    return solid;
}

static bool fill_world(int count)
{
    lw_snapshot_begin(&world);
    for (int id = 1; id <= count;) {
        double vertex[3 * LW_HULL_MAX], p[3], quaternion[4], length = 0;
        for (int i = 0; i < 3; i++)
            p[i] = random_in(-2.5, 2.5);
        if (sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) > 2.5)
            continue;
        for (int i = 0; i < 4; i++) {
            quaternion[i] = random_in(-1, 1);
            length += quaternion[i] * quaternion[i];
        }
        for (int i = 0; i < 4; i++)
            quaternion[i] /= sqrt(length);
        struct lw_pose pose;
        const struct lw_solid solid = random_solid(vertex);
        if (lw_pose_make(p, quaternion, &pose) != LW_OK || lw_snapshot_add(&world, id, 1, &solid, &pose, NULL) != LW_OK)
            return false;
        id++;
    }
    lw_snapshot_end(&world);
    world.version = 1;
    return true;
}

// An arm that swings at up to 1 rad/s a joint, 1000 ticks a second.
static bool crowd(int count, const char *path)
{
    static const char *const set[] = {"robot=ur10", "rate_hz=1000", "law.rho_rep=0.3", "law.remedy=none"};
    static struct lw_scene scene;
    if (!load(path, set, 4, &scene) || !fill_world(count))
        return false;
    char name[64];
    double near = 0; // part of the ticks with an obstacle in reach
    for (int64_t k = -WARM_UP; k < TICKS; k++) {
        struct lw_joint_command command;
        int64_t took_ns;
        double q[LW_NJ];
        for (int j = 0; j < LW_NJ; j++)
            q[j] = sin((0.5 + 0.1 * j) * (double)k * 1e-3 + j) / (0.5 + 0.1 * j);
        timed_tick(k + WARM_UP, q, &command, &took_ns);
        if (k < 0)
            continue;
        duration_ns[k] = took_ns;
        near += command.nearest.clearance <= 0.3;
    }
    snprintf(name, sizeof name, "ur10_%d_obstacles", count);
    print_times(name, TICKS, near / TICKS, ",\n");
    return true;
}

int main(int argc, char **argv)
{
    static const char *const cases[] = {"c1", "c2", "c3", "c4"};
    static const int counts[] = {0, 1, 10, 100, 1000, 10000};
    if (argc != 2) {
        fprintf(stderr, "usage: bench_ticks SCENARIOS\nexample: bench_ticks scenarios\n");
        return 2;
    }
    char path[4096];
    bool ok = true;
    printf("{\n");
    for (int i = 0; ok && i < 4; i++) {
        snprintf(path, sizeof path, "%s/%s.yaml", argv[1], cases[i]);
        ok = paper_case(cases[i], path, i > 0 ? ",\n" : "");
    }
    snprintf(path, sizeof path, "%s/reach.yaml", argv[1]);
    for (size_t i = 0; ok && i < sizeof counts / sizeof counts[0]; i++)
        ok = crowd(counts[i], path);
    printf("\n}\n");
    return ok ? 0 : 1;
}
