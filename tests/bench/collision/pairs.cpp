// SPDX-License-Identifier: BSD-3-Clause
// pairs [BLOCKS]: time of one distance query, link against each kind of shape, cold and warm; coal does the same pairs
// in turns with us where it was found at build time. Prints one JSON object.
//
// Units    ns of this thread's processor time a query.
// Frames   one.
// Arrays   PAIRS pairs of a kind, 2 to 50 cm apart, in a cube of 2 m.
// Memory   static.
// Errors   exit status 0 ok, 1 failed, 2 usage.
#include "measure.hpp"

#include <algorithm> // max
#include <array>
#include <cmath> // sqrt
#include <cstdint>
#include <cstdio>  // printf
#include <cstdlib> // strtol
#include <memory>
#include <vector>

extern "C" {
#include "base/vec.h"
#include "collision/distance.h"
}

#ifdef LEEWAY_COAL
#include <coal/distance.h>
#include <coal/shape/convex.h>
#include <coal/shape/geometric_shapes.h>
#endif

namespace
{

constexpr int PAIRS = 200;

struct contest {
    const char *name;
    lw_shape_kind kind;
    int vertices;
};

const contest kinds[] = {{"sphere", LW_SPHERE, 0}, {"capsule", LW_CAPSULE, 0}, {"box", LW_BOX, 0},
                         {"hull4", LW_HULL, 4},    {"hull8", LW_HULL, 8},      {"hull16", LW_HULL, 16},
                         {"hull32", LW_HULL, 32},  {"hull64", LW_HULL, 64}};

// One pair, ours and theirs.
struct pair {
    lw_capsule link;
    lw_shape shape;
    lw_warm warm;
    lw_pose pose;
    lw_solid solid;
    double vertices[3 * LW_HULL_MAX], room[LW_HULL_ROOM];
#ifdef LEEWAY_COAL
    std::unique_ptr<coal::Capsule> capsule;
    std::unique_ptr<coal::ShapeBase> geometry;
    std::unique_ptr<coal::ComputeDistance> query;
    coal::Transform3s link_at, shape_at;
    coal::DistanceRequest cold, cached;
#endif
};

std::array<pair, PAIRS> &pairs()
{
    static std::array<pair, PAIRS> all;
    return all;
}

bool make(const contest &c, pair &p, uint32_t id)
{
    const double half_length = 0.1;
    double q[4];
    const double place[3] = {uniform(), uniform(), uniform()};
    unit(q, 4);
    for (int i = 0; i < c.vertices; i++) {
        unit(p.vertices + 3 * i, 3);
        for (int k = 0; k < 3; k++)
            p.vertices[3 * i + k] *= 0.12;
    }
    p.solid = {};
    p.solid.kind = c.kind;
    p.solid.radius = c.kind == LW_SPHERE || c.kind == LW_CAPSULE ? 0.06 : 0;
    p.solid.half_length = half_length;
    for (double &h : p.solid.half)
        h = 0.07 + 0.05 * uniform();
    p.solid.count = c.vertices;
    p.solid.vertex = p.vertices;
    if (lw_pose_make(place, q, &p.pose) != LW_OK ||
        lw_shape_make(&p.solid, &p.pose, p.room, &p.shape, nullptr) != LW_OK)
        return false;
    p.shape.id = id;
    p.link.r = 0.05;
    for (int k = 0; k < 3; k++) {
        p.link.a[k] = uniform();
        p.link.b[k] = p.link.a[k] + 0.4 * uniform();
    }
    lw_distance found;
    lw_distance_link(&p.link, &p.shape, HUGE_VAL, nullptr, &found);
    return found.d > 0.02 && found.d < 0.5;
}

// --- ours ---

double sum; // keeps the compiler from leaving queries out
long iterations;

void ours(pair &p, bool warm)
{
    lw_distance found;
    lw_distance_link(&p.link, &p.shape, HUGE_VAL, warm ? &p.warm : nullptr, &found);
    sum += found.d;
    iterations += found.iterations;
}

// --- theirs ---

#ifdef LEEWAY_COAL

void make_theirs(const contest &c, pair &p)
{
    using namespace coal;
    double length = 0;
    for (int k = 0; k < 3; k++)
        length += (p.link.b[k] - p.link.a[k]) * (p.link.b[k] - p.link.a[k]);
    p.capsule = std::make_unique<Capsule>(p.link.r, std::sqrt(length));
    switch (c.kind) {
    case LW_SPHERE: p.geometry = std::make_unique<Sphere>(p.solid.radius); break;
    case LW_CAPSULE: p.geometry = std::make_unique<Capsule>(p.solid.radius, 2 * p.solid.half_length); break;
    case LW_BOX:
        p.geometry = std::make_unique<Box>(2 * p.solid.half[0], 2 * p.solid.half[1], 2 * p.solid.half[2]);
        break;
    default: {
        auto points = std::make_shared<std::vector<Vec3s>>();
        for (int i = 0; i < c.vertices; i++)
            points->emplace_back(p.vertices[3 * i], p.vertices[3 * i + 1], p.vertices[3 * i + 2]);
        p.geometry.reset(ConvexBase::convexHull(points, static_cast<unsigned>(c.vertices), true, nullptr));
    }
    }
    Matrix3s turn;
    for (int i = 0; i < 9; i++)
        turn(i / 3, i % 3) = p.pose.r[i];
    p.shape_at = Transform3s(turn, Vec3s(p.pose.p[0], p.pose.p[1], p.pose.p[2]));
    const Vec3s a(p.link.a[0], p.link.a[1], p.link.a[2]), b(p.link.b[0], p.link.b[1], p.link.b[2]);
    const Matrix3s along = Eigen::Quaternion<CoalScalar>::FromTwoVectors(Vec3s::UnitZ(), b - a).toRotationMatrix();
    p.link_at = Transform3s(along, 0.5 * (a + b));
    p.query = std::make_unique<ComputeDistance>(p.capsule.get(), p.geometry.get());
    p.cold = DistanceRequest();
    p.cached = DistanceRequest();
    p.cached.gjk_initial_guess = GJKInitialGuess::CachedGuess;
}

double theirs(const pair &p, bool warm)
{
    coal::DistanceResult result;
    const coal::DistanceRequest &request = warm ? p.cached : p.cold;
    const double d = (*p.query)(p.link_at, p.shape_at, request, result);
    if (warm)
        request.updateGuess(result);
    sum += d;
    return d;
}

void shift_theirs(pair &p, const double by[3])
{
    p.link_at.translation() += coal::Vec3s(by[0], by[1], by[2]);
}

// Largest difference of the two distances, m.
double largest_difference()
{
    double largest = 0;
    for (const pair &p : pairs()) {
        lw_distance found;
        lw_distance_link(&p.link, &p.shape, HUGE_VAL, nullptr, &found);
        largest = std::max(largest, std::abs(theirs(p, false) - found.d));
    }
    return largest;
}

#else

double largest_difference()
{
    return 0;
}

#endif

// --- measuring ---

// The link moves on by up to a millimetre along each axis.
void move_all()
{
    for (pair &p : pairs()) {
        const double by[3] = {5e-4 * uniform(), 5e-4 * uniform(), 5e-4 * uniform()};
        lw_vec_add_scaled(1, by, p.link.a);
        lw_vec_add_scaled(1, by, p.link.b);
#ifdef LEEWAY_COAL
        shift_theirs(p, by);
#endif
    }
}

template <typename Query> double block(Query query, bool warm)
{
    const double start = now_ns();
    for (size_t i = 0; i < PAIRS; i++)
        query(pairs()[i], warm);
    return (now_ns() - start) / PAIRS;
}

void print_contest(const contest &c, int blocks, bool last)
{
    std::vector<double> time[4], ratio[2];
    long count[2] = {0, 0};
    for (int n = 0; n < blocks; n++)
        for (int warm = 0; warm < 2; warm++) {
            move_all();
            iterations = 0;
            time[warm].push_back(block(ours, warm != 0));
            count[warm] += iterations;
#ifdef LEEWAY_COAL
            time[2 + warm].push_back(block(theirs, warm != 0));
            ratio[warm].push_back(time[2 + warm].back() / time[warm].back());
#endif
        }
    std::printf("  \"%s\": {\"cold_ns\": %.1f, \"warm_ns\": %.1f, \"cold_iterations\": %.4f, \"warm_iterations\": %.4f",
                c.name, median(time[0]), median(time[1]), static_cast<double>(count[0]) / (blocks * PAIRS),
                static_cast<double>(count[1]) / (blocks * PAIRS));
    if (!ratio[0].empty())
        std::printf(", \"coal_cold_ns\": %.1f, \"coal_warm_ns\": %.1f, \"coal_cold_ratio\": %.3f, "
                    "\"coal_warm_ratio\": %.3f, \"largest_difference_m\": %.2g",
                    median(time[2]), median(time[3]), median(ratio[0]), median(ratio[1]), largest_difference());
    std::printf("}%s\n", last ? "" : ",");
}

} // namespace

int main(int argc, char *const *argv)
{
    const long blocks = argc == 2 ? std::strtol(argv[1], nullptr, 10) : 51;
    if (argc > 2 || blocks < 1 || blocks > 100000) {
        std::fprintf(stderr, "usage: pairs [BLOCKS]\n");
        return 2;
    }
    std::printf("{\n");
    for (const contest &c : kinds) {
        uint32_t id = 0;
        for (pair &p : pairs()) {
            id++;
            while (!make(c, p, id))
                ;
            p.warm = {};
#ifdef LEEWAY_COAL
            make_theirs(c, p);
#endif
        }
        print_contest(c, static_cast<int>(blocks), &c == &kinds[7]);
    }
    std::printf("}\n");
    return sum == sum ? EXIT_SUCCESS : EXIT_FAILURE;
}
