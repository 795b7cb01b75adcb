// Provides: build_round_down, build_round_up, build_clip: the bounds of a triangle's part in a box, in float64, rounded outward.
// Needs: nothing.  Reads: nothing.
//
// The same operations in the same order as clrt/kdtree/clip.py, which derives the error bound that PAD covers.
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
#pragma OPENCL FP_CONTRACT OFF
#define PAD 0x1p-47
#define MOST_CORNERS 9  // three, and one more for each of six planes

// Greatest float that is not above the value.
static inline float build_round_down(double value) {
    const float rounded = (float)value;
    return (double)rounded > value ? nextafter(rounded, -INFINITY) : rounded;
}

// Least float that is not below the value.
static inline float build_round_up(double value) {
    const float rounded = (float)value;
    return (double)rounded < value ? nextafter(rounded, INFINITY) : rounded;
}

// Cuts a polygon at a plane: keeps what has sign * coordinate >= plane (Sutherland and Hodgman, 1974). Returns the number of corners.
static int build_cut(double from[][3], int count, int axis, double sign, double plane, double to[][3]) {
    int made = 0;
    for (int i = 0; i < count; i++) {
        const int next = i + 1 < count ? i + 1 : 0;
        const double here = from[i][axis] * sign - plane, there = from[next][axis] * sign - plane;
        const bool keeps = here >= 0.0;
        if (keeps) {
            for (int a = 0; a < 3; a++) to[made][a] = from[i][a];
            made++;
        }
        if (keeps != (there >= 0.0)) {
            // Computed from the inner corner, so that both directions of an edge agree.
            const int inner = keeps ? i : next, outer = keeps ? next : i;
            const double at_inner = keeps ? here : there, at_outer = keeps ? there : here;
            const double t = at_inner / (at_inner - at_outer);
            for (int a = 0; a < 3; a++) to[made][a] = from[inner][a] + (from[outer][a] - from[inner][a]) * t;
            to[made][axis] = sign * plane;
            made++;
        }
    }
    return made;
}

// Bounds of the triangle's part in a box; false where nothing is left.
// Not inlined, nor is build_best_of_axis: calls cost nothing here, and the program compiles sooner by a tenth.
static __attribute__((noinline)) bool build_clip(global const double *triangle, const float *box_lo, const float *box_hi, float *lo,
                                                 float *hi) {
    // Planes and bounds in pairs of three: x, y, z from below, then -x, -y, -z; a polygon is inside where bound >= plane.
    double polygon[2][MOST_CORNERS][3], bounds[6], planes[6];
    double scale = 0.0;
    for (int a = 0; a < 3; a++) {
        for (int c = 0; c < 3; c++) polygon[0][c][a] = triangle[3 * c + a];
        const double p = polygon[0][0][a], q = polygon[0][1][a], r = polygon[0][2][a];
        bounds[a] = fmin(fmin(p, q), r);
        bounds[3 + a] = -fmax(fmax(p, q), r);
        scale = fmax(scale, fmax(-bounds[a], -bounds[3 + a]));
    }
    const double pad = PAD * scale;
    for (int a = 0; a < 3; a++) {
        planes[a] = (double)box_lo[a] - pad;
        planes[3 + a] = -(double)box_hi[a] - pad;
    }
    int count = 3, now = 0;
    // Rounding may leave a corner a hair beyond a plane that has cut it: no plane cuts twice.
    for (int i = 0; i < 6 && count > 0; i++) {
        int which = 0;
        while (which < 6 && !(bounds[which] < planes[which])) which++;
        if (which == 6) break;
        count = build_cut(polygon[now], count, which % 3, which < 3 ? 1.0 : -1.0, planes[which], polygon[1 - now]);
        now = 1 - now;
        planes[which] = -INFINITY;
        for (int b = 0; b < 6; b++) bounds[b] = INFINITY;
        for (int c = 0; c < count; c++) {
            for (int a = 0; a < 3; a++) {
                bounds[a] = fmin(bounds[a], polygon[now][c][a]);
                bounds[3 + a] = fmin(bounds[3 + a], -polygon[now][c][a]);
            }
        }
    }
    bool left = true;
    for (int a = 0; a < 3; a++) {
        const double low = fmax(bounds[a] - pad, (double)box_lo[a]), high = fmin(-(bounds[3 + a] - pad), (double)box_hi[a]);
        left = left && low <= high;
        lo[a] = build_round_down(low);
        hi[a] = build_round_up(high);
    }
    return left;
}
