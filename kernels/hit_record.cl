// Provides: hit_record: the record of a hit.
// Needs: triangle.cl, given.cl, structs.  Reads: nothing.

// corner - (origin + s direction), a component: the difference and the product as unevaluated sums (Knuth 1969; Dekker 1971 by FMA), so
// that it is off by at most 2u of itself and 4u^2 of |corner - origin| + |s direction|, u = 2^-53.
HOT double corner_seen(double corner, double origin, double direction, double s) {
    const double high = corner - origin, part = high - corner, low = (corner - (high - part)) - (origin + part);
    const double product = s * direction, rest = fma(s, direction, -product);
    return (high - product) + (low - rest);
}

// The record of the hit of a ray with the triangle `slot`, or of a miss where that is -1; by the numbers as given, in float64. With a = v0 - o,
// n = e1 x e2 and rate = d.n:
//   t = a.n / rate,  u = d.(e2 x a) / rate,  v = d.(a x e1) / rate.
// No multiple of d added to a changes u and v, so they are taken from `near` = a - s d at s = t but for rounding, which is no longer than
// the triangle however far the origin is; and t = s + near.n / rate.
HOT void hit_record(global const double *vertices, global const HitSource *sources, const GivenRay *ray, int slot, global HitRecord *record) {
    if (slot < 0) {
        const HitRecord miss = {INFINITY, 0, 0, -1, -1, {0, 0, 0}};
        *record = miss;
        return;
    }
    global const double *corners = vertices + 9 * (size_t)slot;
    double a[3], d[3], e1[3], e2[3], n[3], near[3], cross[3];
    for (int axis = 0; axis < 3; axis++) {
        a[axis] = corners[axis] - ray->origin[axis];
        d[axis] = ray->direction[axis];
        e1[axis] = corners[3 + axis] - corners[axis];
        e2[axis] = corners[6 + axis] - corners[axis];
    }
    cross_double(e1, e2, n);
    const double rate = dot_double(d, n), s = dot_double(a, n) / rate;
    for (int axis = 0; axis < 3; axis++) near[axis] = corner_seen(corners[axis], ray->origin[axis], d[axis], s);
    double t = s + dot_double(near, n) / rate;
    cross_double(e2, near, cross);
    double u = dot_double(d, cross) / rate;
    cross_double(near, e1, cross);
    double v = dot_double(d, cross) / rate;
    //@ finish
    record->t = t * ray->scale;
    record->u = u;
    record->v = v;
    record->prim_id = sources[slot].prim_id;
    record->object_id = sources[slot].object_id;
    for (int axis = 0; axis < 3; axis++) record->normal[axis] = sources[slot].normal[axis];
}
