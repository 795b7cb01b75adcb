// Provides: kernel prepare: the records that rays test, from the numbers as given. One for all of them: PoCL compiles each kernel by itself, and
//           what is inlined into it three times: so its parts are not.
// Needs: lanes.cl, structs, triangle.cl.  Reads: nothing.
//
// All in float64, rounded once to `real`; the bounds are derived in triangle.cl, and where effects add others.
static inline double length_double(const double *a) { return sqrt(dot_double(a, a)); }

// 8u |n|, and the float64 error of n = e1 x e2 itself, which is below 4 * 2^-53 |e1||e2| and counts for needles.
static inline double normal_bound(const double *e1, const double *e2, const double *normal) {
    return 8 * UNIT_ROUNDOFF * length_double(normal) + 16 * 0x1p-53 * length_double(e1) * length_double(e2);
}

// The power of two that brings a length into [1, 2).
static inline double power_below(double length) {
    const long biased = (long)(as_ulong(length) >> 52);
    return as_double((ulong)(2046 - (biased > 2045 ? 2045 : biased)) << 52);
}

static __attribute__((noinline)) void prepare_triangle(global const double *vertices, int slot, const double *origin, global Triangle *triangles) {
    double e1[3], e2[3], normal[3];
    for (int a = 0; a < 3; a++) {
        const double v0 = vertices[9 * slot + a];
        e1[a] = vertices[9 * slot + 3 + a] - v0;
        e2[a] = vertices[9 * slot + 6 + a] - v0;
        triangles[slot].v0[a] = (real)(v0 - origin[a]);
    }
    cross_double(e1, e2, normal);
    const double scale = power_below(length_double(normal));
    for (int a = 0; a < 3; a++) {
        triangles[slot].e1[a] = (real)e1[a];
        triangles[slot].e2[a] = (real)e2[a];
        triangles[slot].normal[a] = (real)(scale * normal[a]);
    }
    triangles[slot].bound = (real)(64 * UNIT_ROUNDOFF * fmax(length_double(e1), length_double(e2)));
    triangles[slot].normal_bound = (real)(scale * normal_bound(e1, e2, normal));
    //@ prepare_triangle
}

static __attribute__((noinline)) void prepare_planes(global const double *vertices, int slot, const double *origin, global EdgePlanes *planes) {
    double corner[3][3], e1[3], e2[3], normal[3], edge[3][3], longest = 0, steepest = 0;
    for (int c = 0; c < 3; c++)
        for (int a = 0; a < 3; a++) corner[c][a] = vertices[9 * slot + 3 * c + a] - origin[a];
    for (int c = 0; c < 3; c++) {
        const double *b = corner[(c + 1) % 3], *e = corner[(c + 2) % 3];
        cross_double(b, e, edge[c]);
        steepest = fmax(steepest, length_double(edge[c]));
        longest = fmax(longest, length_double(b) * length_double(e));
    }
    for (int a = 0; a < 3; a++) {
        e1[a] = vertices[9 * slot + 3 + a] - vertices[9 * slot + a];
        e2[a] = vertices[9 * slot + 6 + a] - vertices[9 * slot + a];
        planes->u[a] = (real)edge[0][a];
        planes->v[a] = (real)edge[1][a];
        planes->w[a] = (real)edge[2][a];
    }
    cross_double(e1, e2, normal);
    const double offset = dot_double(corner[0], normal), size = length_double(normal), bound = normal_bound(e1, e2, normal);
    const double offset_error = 16 * 0x1p-53 * length_double(corner[0]) * length_double(e1) * length_double(e2), scale = power_below(size);
    for (int a = 0; a < 3; a++) planes->normal[a] = (real)(scale * normal[a]);
    planes->offset = (real)(scale * offset);
    planes->bound = (real)(3 * UNIT_ROUNDOFF * steepest + 16 * 0x1p-53 * longest + UNDERFLOWN);
    planes->normal_bound = (real)(scale * bound);
    planes->t_bound = (real)((2 + 0x1p-18) * ((scale * fabs(offset)) * (scale * bound) + (scale * size) * (scale * offset_error)) + 0x1p-120);
}

// What is prepared, an item a work-item up to `count`: triangles for rays of any origin, relative to the local one; planes as seen from a
// shared origin, from record `first` on; what effects add.
#define PREPARE_TRIANGLES 0
#define PREPARE_PLANES 1

kernel void prepare(int what, global const double *vertices, double4 given_origin, global Triangle *triangles, global EdgePlanes *planes, int first,
                    int count
                    //@ prepare_parameters
) {
    const int item = get_global_id(0);
    if (item >= count) return;
    const double origin[3] = {given_origin.x, given_origin.y, given_origin.z};
    if (what == PREPARE_TRIANGLES) prepare_triangle(vertices, item, origin, triangles);
    if (what == PREPARE_PLANES) prepare_planes(vertices, item, origin, planes + first + item);
    //@ prepare
}
