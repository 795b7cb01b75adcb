// Provides: globe_place: where on a picture a point of a sphere lies, by longitude and latitude.
// Needs: sphere.cl, structs.  Reads: nothing.

// u = 1/2 towards -z, growing towards +x, which is to the right as seen from there; v = 0 at the lowest point, 1 at the highest.
HOT void globe_place(global const Sphere *sphere, const double *point, double *uv) {
    double out[3];
    for (int a = 0; a < 3; a++) out[a] = point[a] - sphere->given[a];
    uv[0] = 0.5 + atan2pi(out[0], -out[2]) / 2;
    uv[1] = 0.5 + atan2pi(out[1], sqrt(out[0] * out[0] + out[2] * out[2]));
}

//@hook texture_place
    if (slot >= geometry->slot_count) globe_place(geometry->spheres + (slot - geometry->slot_count), point, uv);
//@end
