// SPDX-License-Identifier: BSD-3-Clause
// arm [TICKS]: time of one tick's distance queries, seven capsules of a moving UR10 against 1 to 10,000 obstacles: all
// pairs within 0.3 m, and the nearest obstacle of each capsule. coal's dynamic tree does the same in turns with us
// where it was found at build time. Prints one JSON object. What is counted is exact: it differs from run to run by
// nothing.
//
// Units    us a tick, read from a clock that does not stop for other programs: medians count.
// Frames   base frame.
// Arrays   obstacles of 2 to 12 cm in a ball of 2.5 m: half of them hulls of 8 to 64 vertices, one in five boxes, one
// in
//          five spheres, the rest capsules.
// Memory   static, and coal's own.
// Errors   exit status 0 ok, 1 failed: the pairs in range or the nearest distances are not coal's; 2 usage.
#include "measure.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>  // printf
#include <cstdlib> // strtol
#include <memory>
#include <vector>

extern "C" {
#include "collision/near.h"
}

#ifdef LEEWAY_COAL
#include <coal/broadphase/broadphase_dynamic_AABB_tree.h>
#include <coal/distance.h>
#include <coal/shape/convex.h>
#include <coal/shape/geometric_shapes.h>
#endif

// The linker puts this before every query of one pair; the names are those that ld --wrap asks for.
// NOLINTBEGIN(bugprone-reserved-identifier,readability-identifier-naming)
extern "C" {
void __real_lw_distance_link(const lw_capsule *link, const lw_shape *shape, double d_max, lw_warm *warm,
                             lw_distance *out);
void __wrap_lw_distance_link(const lw_capsule *link, const lw_shape *shape, double d_max, lw_warm *warm,
                             lw_distance *out);
}
// NOLINTEND(bugprone-reserved-identifier,readability-identifier-naming)

namespace
{

constexpr double D_MAX = 0.3, RATE = 1, PERIOD = 1e-3;
constexpr int PARTS = 7;

long measured;

// --- the world ---

struct thing {
    lw_solid solid;
    lw_pose pose;
    double vertices[3 * LW_HULL_MAX];
};

std::vector<thing> things;
lw_snapshot world;
lw_body body;
lw_placed placed;
lw_warm_table warm;
lw_near_list in_range;
lw_near nearest[LW_BODY_MAX];

bool make(thing &t)
{
    const double kind = uniform(0, 1), size = uniform(0.02, 0.12) / 2;
    double q[4], place[3];
    do
        for (double &x : place)
            x = 2.5 * uniform();
    while (place[0] * place[0] + place[1] * place[1] + place[2] * place[2] > 2.5 * 2.5);
    unit(q, 4);
    t.solid = {};
    t.solid.kind = kind < 0.5 ? LW_HULL : kind < 0.7 ? LW_BOX : kind < 0.8 ? LW_CAPSULE : LW_SPHERE;
    t.solid.radius = t.solid.kind == LW_SPHERE ? size : t.solid.kind == LW_CAPSULE ? size / 2 : 0;
    t.solid.half_length = size / 2;
    for (double &h : t.solid.half)
        h = size * uniform(0.5, 1);
    t.solid.count = 8 + static_cast<int>(uniform(0, 57));
    for (int i = 0; i < t.solid.count; i++) {
        unit(t.vertices + 3 * i, 3);
        for (int k = 0; k < 3; k++)
            t.vertices[3 * i + k] *= size;
    }
    return lw_pose_make(place, q, &t.pose) == LW_OK;
}

void move_arm(int tick)
{
    double q[LW_NJ];
    const double home[LW_NJ] = {0, -1.2, 1.4, -1.8, -1.5, 0};
    lw_pose frame[LW_NJ];
    for (int i = 0; i < LW_NJ; i++)
        q[i] = home[i] + RATE * PERIOD * tick;
    if (lw_arm_fk(lw_arm_get(LW_UR10), q, frame) == LW_OK)
        lw_body_place(&body, frame, &placed);
}

// Whether a thing is clear of the arm on all its way: coal looks no further once two overlap.
bool clear(const thing &t, int ticks)
{
    double room[LW_HULL_ROOM];
    lw_shape shape;
    lw_distance found;
    if (lw_shape_make(&t.solid, &t.pose, room, &shape, nullptr) != LW_OK)
        return false;
    for (int tick = 0; tick <= ticks; tick += 10) {
        move_arm(tick);
        for (int part = 0; part < PARTS; part++) {
            lw_distance_link(&placed.capsule[part], &shape, 0.1, nullptr, &found);
            if (found.d < 0.02)
                return false;
        }
    }
    return true;
}

bool build(int count, int ticks)
{
    things.resize(static_cast<size_t>(count));
    lw_snapshot_begin(&world);
    int id = 0;
    for (thing &t : things) {
        do {
            if (!make(t))
                return false;
            t.solid.vertex = t.vertices;
        } while (!clear(t, ticks));
        if (lw_snapshot_add(&world, ++id, 1, &t.solid, &t.pose, nullptr) != LW_OK)
            return false;
    }
    const double start = now_ns();
    lw_snapshot_end(&world);
    std::printf("\"sort_us\": %.1f", 1e-3 * (now_ns() - start));
    return true;
}

// --- ours ---

double sum; // keeps the compiler from leaving queries out

void ours(bool each)
{
    const lw_near_query query = {&body, &placed, &world, 0, each ? HUGE_VAL : D_MAX, &warm};
    if (each)
        lw_near_each(&query, nearest);
    else
        lw_near_range(&query, &in_range);
    sum += each ? nearest[0].distance.d : in_range.needed;
}

// --- theirs ---

#ifdef LEEWAY_COAL

// One pair's query and where it ended.
struct memory {
    std::unique_ptr<coal::ComputeDistance> query;
    coal::DistanceRequest request;
};

struct rival : coal::DistanceCallBackBase, coal::CollisionCallBackBase {
    std::vector<std::shared_ptr<coal::CollisionGeometry>> shapes;
    std::vector<std::unique_ptr<coal::CollisionObject>> obstacles;
    std::array<std::unique_ptr<coal::CollisionObject>, PARTS> links;
    std::array<std::vector<memory>, PARTS> memories;
    coal::DynamicAABBTreeCollisionManager tree;
    size_t part = 0;
    long calls = 0;
    int found = 0;
    double least = 0;

    double measure(const coal::CollisionObject *obstacle)
    {
        const size_t i = reinterpret_cast<size_t>(obstacle->getUserData());
        const coal::CollisionObject &link = *links[part];
        memory &m = memories[part][i];
        if (!m.query) {
            m.query =
                std::make_unique<coal::ComputeDistance>(link.collisionGeometryPtr(), obstacle->collisionGeometryPtr());
            m.request.gjk_initial_guess = coal::GJKInitialGuess::CachedGuess;
        }
        coal::DistanceResult result;
        const double d = (*m.query)(link.getTransform(), obstacle->getTransform(), m.request, result);
        m.request.updateGuess(result);
        calls++;
        return d;
    }

    bool collide(coal::CollisionObject *a, coal::CollisionObject *b) override
    {
        found += measure(a == links[part].get() ? b : a) <= D_MAX;
        return false;
    }

    bool distance(coal::CollisionObject *a, coal::CollisionObject *b, double &dist) override
    {
        least = std::min(least, measure(a == links[part].get() ? b : a));
        dist = least;
        return false;
    }
};

std::unique_ptr<rival> coal_side;

std::shared_ptr<coal::CollisionGeometry> geometry(const thing &t)
{
    using namespace coal;
    switch (t.solid.kind) {
    case LW_SPHERE: return std::make_shared<Sphere>(t.solid.radius);
    case LW_CAPSULE: return std::make_shared<Capsule>(t.solid.radius, 2 * t.solid.half_length);
    case LW_BOX: return std::make_shared<Box>(2 * t.solid.half[0], 2 * t.solid.half[1], 2 * t.solid.half[2]);
    default: {
        auto points = std::make_shared<std::vector<Vec3s>>();
        for (int i = 0; i < t.solid.count; i++)
            points->emplace_back(t.vertices[3 * i], t.vertices[3 * i + 1], t.vertices[3 * i + 2]);
        return std::shared_ptr<CollisionGeometry>(
            ConvexBase::convexHull(points, static_cast<unsigned>(t.solid.count), true, nullptr));
    }
    }
}

void start_theirs()
{
    coal_side = std::make_unique<rival>();
    rival &r = *coal_side;
    std::vector<coal::CollisionObject *> all;
    for (size_t i = 0; i < things.size(); i++) {
        const thing &t = things[i];
        coal::Matrix3s turn;
        for (int k = 0; k < 9; k++)
            turn(k / 3, k % 3) = t.pose.r[k];
        r.shapes.push_back(geometry(t));
        r.obstacles.push_back(std::make_unique<coal::CollisionObject>(
            r.shapes.back(), turn, coal::Vec3s(t.pose.p[0], t.pose.p[1], t.pose.p[2])));
        r.obstacles.back()->setUserData(reinterpret_cast<void *>(i));
        all.push_back(r.obstacles.back().get());
    }
    r.tree.registerObjects(all);
    r.tree.setup();
    for (size_t part = 0; part < PARTS; part++) {
        const lw_capsule &c = body.part[part].capsule;
        double length = 0;
        for (int k = 0; k < 3; k++)
            length += (c.b[k] - c.a[k]) * (c.b[k] - c.a[k]);
        // coal has no capsule of length 0 worth a name: the sphere is one
        if (length > 0)
            r.shapes.push_back(std::make_shared<coal::Capsule>(c.r, std::sqrt(length)));
        else
            r.shapes.push_back(std::make_shared<coal::Sphere>(c.r));
        r.links[part] = std::make_unique<coal::CollisionObject>(r.shapes.back());
        r.memories[part].resize(things.size());
    }
}

// Puts their links where ours are; not timed.
void place_theirs()
{
    for (size_t part = 0; part < PARTS; part++) {
        const lw_capsule &c = placed.capsule[part];
        const coal::Vec3s a(c.a[0], c.a[1], c.a[2]), b(c.b[0], c.b[1], c.b[2]);
        coal::Matrix3s along = coal::Matrix3s::Identity();
        if ((b - a).norm() > 0)
            along = Eigen::Quaternion<coal::CoalScalar>::FromTwoVectors(coal::Vec3s::UnitZ(), b - a).toRotationMatrix();
        coal_side->links[part]->setTransform(along, 0.5 * (a + b));
        coal_side->links[part]->computeAABB();
    }
}

void theirs(bool each)
{
    rival &r = *coal_side;
    r.found = 0;
    for (r.part = 0; r.part < PARTS; r.part++) {
        coal::CollisionObject *link = r.links[r.part].get();
        if (each) {
            r.least = HUGE_VAL;
            r.tree.distance(link, &r);
            sum += r.least;
            continue;
        }
        // Their tree finds what overlaps the link's box, made larger by the range.
        const coal::AABB tight = link->getAABB();
        link->getAABB().expand(D_MAX);
        r.tree.collide(link, &r);
        link->getAABB() = tight;
    }
}

#endif

// --- measuring ---

struct figures {
    std::vector<double> ours, theirs, ratio;
    long pairs = 0, ours_measured = 0, theirs_measured = 0;
    double difference = 0;
};

void time_ours(bool each, figures &f)
{
    measured = 0;
    const double start = now_ns(CLOCK_MONOTONIC);
    ours(each);
    f.ours.push_back(1e-3 * (now_ns(CLOCK_MONOTONIC) - start));
    f.ours_measured += measured;
}

#ifdef LEEWAY_COAL

void time_theirs(bool each, figures &f)
{
    coal_side->calls = 0;
    const double start = now_ns(CLOCK_MONOTONIC);
    theirs(each);
    f.theirs.push_back(1e-3 * (now_ns(CLOCK_MONOTONIC) - start));
    f.theirs_measured += coal_side->calls;
}

// Whether the two agree on the tick just timed: as many pairs in range, nearest distances to coal's tolerance.
bool agree(bool each, figures &f)
{
    if (!each)
        return coal_side->found == in_range.needed;
    double apart = 0;
    rival &r = *coal_side;
    for (r.part = 0; r.part < PARTS; r.part++) {
        r.least = HUGE_VAL;
        r.tree.distance(r.links[r.part].get(), &r);
        apart = std::max(apart, std::abs(r.least - nearest[r.part].distance.d));
    }
    f.difference = std::max(f.difference, apart);
    return apart < 1e-5;
}

#endif

bool one_tick(bool each, int tick, figures &f)
{
    move_arm(tick);
#ifdef LEEWAY_COAL
    place_theirs();
    if (tick % 2)
        time_theirs(each, f);
    time_ours(each, f);
    if (tick % 2 == 0)
        time_theirs(each, f);
    f.ratio.push_back(f.theirs.back() / f.ours.back());
    if (!agree(each, f))
        return false;
#else
    time_ours(each, f);
#endif
    f.pairs += each ? 0 : in_range.needed;
    return true;
}

double largest(const std::vector<double> &values)
{
    return *std::max_element(values.begin(), values.end());
}

bool contest(bool each, int ticks)
{
    figures f;
    warm = {};
    for (int tick = 0; tick < ticks; tick++)
        if (!one_tick(each, tick, f)) {
            std::fprintf(stderr, "arm: tick %d: ours and coal's differ\n", tick);
            return false;
        }
    std::printf(", \"%s\": {\"us\": %.3f, \"first_us\": %.2f, \"max_us\": %.2f, \"measured\": %.3f",
                each ? "nearest" : "range", median(f.ours), f.ours[0], largest(f.ours),
                static_cast<double>(f.ours_measured) / ticks);
    if (!each)
        std::printf(", \"pairs\": %.3f", static_cast<double>(f.pairs) / ticks);
    if (!f.theirs.empty())
        std::printf(", \"coal_us\": %.3f, \"coal_max_us\": %.2f, \"coal_measured\": %.3f, \"coal_ratio\": %.3f",
                    median(f.theirs), largest(f.theirs), static_cast<double>(f.theirs_measured) / ticks,
                    median(f.ratio));
    if (each && !f.theirs.empty())
        std::printf(", \"largest_difference_m\": %.2g", f.difference);
    std::printf("}");
    return true;
}

} // namespace

// NOLINTNEXTLINE(bugprone-reserved-identifier,readability-identifier-naming)
void __wrap_lw_distance_link(const lw_capsule *link, const lw_shape *shape, double d_max, lw_warm *warm_start,
                             lw_distance *out)
{
    measured++;
    __real_lw_distance_link(link, shape, d_max, warm_start, out);
}

int main(int argc, char *const *argv)
{
    const long ticks = argc == 2 ? std::strtol(argv[1], nullptr, 10) : 200;
    if (argc > 2 || ticks < 1 || ticks > 100000) {
        std::fprintf(stderr, "usage: arm [TICKS]\n");
        return 2;
    }
    lw_tool tool = {};
    tool.kind = LW_TOOL_CAPSULE;
    tool.capsule = {{0, 0, 0}, {0, 0, 0.15}, 0.04};
    lw_body_make(LW_UR10, LW_BODY_CAPSULES, &tool, &body);
    std::printf("{\n");
    for (const int count : {1, 10, 100, 1000, 10000}) {
        std::printf("  \"%d\": {", count);
        if (!build(count, static_cast<int>(ticks)))
            return EXIT_FAILURE;
#ifdef LEEWAY_COAL
        start_theirs();
#endif
        for (const bool each : {false, true})
            if (!contest(each, static_cast<int>(ticks)))
                return EXIT_FAILURE;
        std::printf("}%s\n", count == 10000 ? "" : ",");
    }
    std::printf("}\n");
    return sum == sum ? EXIT_SUCCESS : EXIT_FAILURE;
}
