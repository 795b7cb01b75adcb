// Provides: GivenRays: the caller's arrays; ray_given_scaled: one ray out of them.
// Needs: lanes.cl, structs.  Reads: nothing.

// Arrays of float64, or of float32 where bit a of `kinds` is set (a: the array's place here); of one element for all rays where bit 4 + a is.
// `unit` is the power of two that brings the mesh to unit size.
typedef struct {
    global const uchar *origins, *directions, *t_min, *t_max;
    int kinds;
    double unit;
} GivenRays;

#define GIVEN_PARAMETERS \
    global const uchar *origins, global const uchar *directions, global const uchar *t_min, global const uchar *t_max, int kinds, double unit
#define GIVEN_ARGUMENTS {origins, directions, t_min, t_max, kinds, unit}

HOT double given_number(global const uchar *numbers, int kinds, int array, size_t i) {
    return (kinds >> array) & 1 ? (double)((global const float *)numbers)[i] : ((global const double *)numbers)[i];
}

HOT void given_vector(global const uchar *numbers, int kinds, int array, size_t ray, double *vector) {
    const size_t first = (kinds >> (4 + array)) & 1 ? 0 : 3 * ray;
    for (int a = 0; a < 3; a++) vector[a] = given_number(numbers, kinds, array, first + a);
}

// The direction is scaled by a power of two, without rounding, that brings its largest component into [1, 2), and the limits with it, so that
// no length over- or underflows; `scale` keeps that power for the record.
// False for a ray that is known to miss: a NaN, an infinity, no direction, an empty interval.
HOT int ray_given_scaled(const GivenRays *rays, size_t i, GivenRay *ray) {
    double largest = 0, size;
    given_vector(rays->origins, rays->kinds, 0, i, ray->origin);
    given_vector(rays->directions, rays->kinds, 1, i, ray->direction);
    ray->t_min = given_number(rays->t_min, rays->kinds, 2, (rays->kinds >> 6) & 1 ? 0 : i);
    ray->t_max = given_number(rays->t_max, rays->kinds, 3, (rays->kinds >> 7) & 1 ? 0 : i);
    int good = ray->t_min < ray->t_max;
    for (int a = 0; a < 3; a++) {
        ray->origin[a] *= rays->unit;
        ray->direction[a] *= rays->unit;
        size = fabs(ray->direction[a]);
        good &= size < INFINITY && fabs(ray->origin[a]) < INFINITY;
        largest = size > largest ? size : largest;
    }
    if (!good || largest == 0) return 0;
    // The exponent from its bits; both powers stay in range, and below 2^-1022 the largest component stays below 1.
    const long biased = (long)(as_ulong(largest) >> 52), exponent = (biased < 1 ? 1 : biased > 2045 ? 2045 : biased) - 1023;
    const double inverse = as_double((ulong)(1023 + exponent) << 52);
    ray->scale = as_double((ulong)(1023 - exponent) << 52);
    for (int a = 0; a < 3; a++) ray->direction[a] *= ray->scale;
    ray->t_min *= inverse;
    ray->t_max *= inverse;
    return 1;
}

// Asks for memory ahead of its use, to read or to write it; rays in sorted order lie anywhere in the caller's arrays.
#ifdef __clang__
#define fetch_bytes_ahead(pointer, bytes, write)                                              \
    {                                                                                   \
        __builtin_prefetch((const void *)(size_t)(pointer), write);                      \
        __builtin_prefetch((const void *)((size_t)(pointer) + (bytes) - 1), write);       \
    }
#else
#define fetch_bytes_ahead(pointer, bytes, write)
#endif

HOT void ray_given_ahead(const GivenRays *rays, size_t i) {
    const size_t origin = rays->kinds & 1 ? 12 : 24, direction = rays->kinds & 2 ? 12 : 24;
    if (!(rays->kinds & 16)) fetch_bytes_ahead(rays->origins + origin * i, origin, 0);
    if (!(rays->kinds & 32)) fetch_bytes_ahead(rays->directions + direction * i, direction, 0);
}
