// SPDX-License-Identifier: BSD-3-Clause
// Distances of random pairs of 22 classes against brute force in 80-bit arithmetic, against their own certificate, and
// against libccd's opinion on overlap. LEEWAY_PAIRS sets the number of pairs a class; 4600 make 100,000.
//
// Units    metres.
// Frames   one.
// Arrays   see distance_pairs.h.
// Memory   none.
// Errors   cmocka's; each class prints its worst values when LEEWAY_PAIRS is set.
#include "collision/custom.h" // ccd_t
#include "distance_oracle.h"
#include "distance_pairs.h"
#include "helpers.h"

// What a class is held to, m. Cores that nearly touch without a radius have no normal to speak of.
struct allowed {
    double error, gap, identity;
};

static struct allowed allowed_of(enum pair_class class)
{
    struct allowed a = {5e-15, 1e-12, 2e-15};
    switch (class) {
    case FAR_BOTH: a.error = a.identity = 1e-12; break;
    case FAR_APART: return (struct allowed){5e-12, 5e-12, 5e-12};
    case BARE_PLUS_NANO:
    case BARE_MINUS_MICRO: a.gap = 1e-6; break;
    case BARE_PLUS_MICRO: a.gap = 1e-9; break;
    case NEAR_DUPLICATE: a.error = a.gap = 5e-12; break;
    case TINY:
    case PLATE:
    case NEEDLE: a.error = 1e-11; break; // where EPA stops
    case LARGE: return (struct allowed){2e-13, 2e-13, 1e-13};
    default: break;
    }
    return a;
}

struct worst {
    double error, gap, identity, off;
    int iterations;
};

static void raise(double *worst, double value)
{
    *worst = value > *worst ? value : *worst;
}

static void dump(const struct pair *pair, enum pair_class class, const char *what, double value)
{
    print_error("%s: %s %.3g, shape %d of %d points\n", class_name[class], what, value, (int)pair->shape.kind,
                pair->count);
    print_error("link %a %a %a, %a %a %a, r %a\n", pair->link.a[0], pair->link.a[1], pair->link.a[2], pair->link.b[0],
                pair->link.b[1], pair->link.b[2], pair->link.r);
    for (int i = 0; i < pair->count; i++)
        print_error("  {%a, %a, %a},\n", pair->points[i][0], pair->points[i][1], pair->points[i][2]);
}

// --- libccd's test for overlap of the cores ---

static void pair_support(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *out)
{
    const struct pair *pair = object;
    double best = -HUGE_VAL;
    for (int i = 0; i < pair->count; i++) {
        const double height = lw_vec_dot(pair->points[i], direction->v);
        if (height <= best)
            continue;
        best = height;
        memcpy(out->v, pair->points[i], sizeof out->v);
    }
}

static void link_support(const void *object, const ccd_vec3_t *direction, ccd_vec3_t *out)
{
    const struct pair *pair = object;
    const bool end = lw_vec_dot(pair->link.b, direction->v) > lw_vec_dot(pair->link.a, direction->v);
    memcpy(out->v, end ? pair->link.b : pair->link.a, sizeof out->v);
}

static bool libccd_says_overlap(const struct pair *pair)
{
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.support1 = link_support;
    ccd.support2 = pair_support;
    ccd.max_iterations = 100;
    return ccdGJKIntersect(pair, pair, &ccd) != 0;
}

// --- the property ---

static void check_pair(const struct pair *pair, enum pair_class class, struct worst *worst)
{
    struct lw_distance found;
    const double radii = pair->link.r + pair->shape.r;
    lw_distance_link(&pair->link, &pair->shape, HUGE_VAL, NULL, &found);
    assert_false(found.flags & (LW_DISTANCE_CAPPED | LW_DISTANCE_STALLED | LW_DISTANCE_FAR | LW_DISTANCE_NO_NORMAL));

    double ends[2][3];
    memcpy(ends[0], pair->link.a, sizeof ends[0]);
    memcpy(ends[1], pair->link.b, sizeof ends[1]);
    const long double core = oracle_distance(ends[0], 2, pair->points[0], pair->count);
    const double error = fabs((double)((long double)found.d - (core - (long double)radii)));
    const double gap = fabs(lw_distance_gap(&pair->link, &pair->shape, &found));
    double identity = fabs(lw_vec_norm(found.n) - 1);
    for (int k = 0; k < 3; k++)
        raise(&identity, fabs(found.pa[k] - found.pb[k] - found.d * found.n[k]));
    // The witness points are those of the cores, moved by the radii.
    double qa[3], qb[3];
    for (int k = 0; k < 3; k++) {
        qa[k] = found.pa[k] + pair->link.r * found.n[k];
        qb[k] = found.pb[k] - pair->shape.r * found.n[k];
    }
    const double off = fmax((double)oracle_apart_points(qa, 1, ends[0], 2),
                            (double)oracle_apart_points(qb, 1, pair->points[0], pair->count));
    const struct allowed allowed = allowed_of(class);
    // Written so that a NaN fails.
    const char *what = !(error <= allowed.error)         ? "distance off by"
                       : !(gap <= allowed.gap)           ? "gap"
                       : !(identity <= allowed.identity) ? "pa - pb - d n"
                       : !(off <= 5e-12)                 ? "witness point beside its core by"
                                                         : NULL;
    if (what != NULL) {
        dump(pair, class, what, what[0] == 'd' ? error : what[0] == 'g' ? gap : what[0] == 'p' ? identity : off);
        fail();
    }
    // libccd has an absolute epsilon: hulls of 1 mm are too small for it.
    if (class != TINY && fabs((double)core) > 1e-6 && libccd_says_overlap(pair) != (core < 0)) {
        dump(pair, class, "libccd disagrees at", (double)core);
        fail();
    }
    raise(&worst->off, off);
    raise(&worst->error, error);
    raise(&worst->gap, gap);
    raise(&worst->identity, identity);
    worst->iterations = found.iterations > worst->iterations ? found.iterations : worst->iterations;
}

static void distances_of_all_classes_are_exact(void **state)
{
    (void)state;
    const char *asked = getenv("LEEWAY_PAIRS"); // NOLINT(concurrency-mt-unsafe): one thread
    const long pairs = asked != NULL ? strtol(asked, NULL, 10) : 2000;
    assert_true(pairs > 0);
    for (int class = 0; class < CLASSES; class++) {
        struct random random = {(uint64_t)(1000 + class)};
        struct worst worst = {.error = 0};
        for (long n = 0; n < pairs; n++) {
            static struct pair pair;
            pair_make(&random, (enum pair_class)class, &pair);
            check_pair(&pair, (enum pair_class)class, &worst);
        }
        if (asked != NULL)
            print_message("%-16s error %.1e  gap %.1e  identity %.1e  off %.1e  iterations %d\n", class_name[class],
                          worst.error, worst.gap, worst.identity, worst.off, worst.iterations);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distances_of_all_classes_are_exact),
    };
    return cmocka_run_group_tests_name("distance_property", tests, NULL, NULL);
}
