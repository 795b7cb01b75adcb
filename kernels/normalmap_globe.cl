// Provides: normalmap_on_sphere: the frame of a normal map on a sphere.
// Needs: sphere.cl, structs.  Reads: nothing.

// u grows towards +x where the sphere faces -z: along (-z, 0, x) of the outward normal; v grows upwards. No frame at the poles. N may be the inner side's.
HOT int normalmap_on_sphere(global const Sphere *sphere, const double *point, double *x, double *y) {
    double out[3];
    for (int a = 0; a < 3; a++) out[a] = (point[a] - sphere->given[a]) / sphere->given[3];
    const double ring = sqrt(out[0] * out[0] + out[2] * out[2]), length = sqrt(ring * ring + out[1] * out[1]);
    if (!(ring > 0)) return 0;
    x[0] = -out[2] / ring, x[1] = 0, x[2] = out[0] / ring;
    y[0] = -out[1] * out[0] / (ring * length), y[1] = ring / length, y[2] = -out[1] * out[2] / (ring * length);
    return 1;
}

//@hook normalmap_frame
        if (slot[k] >= geometry->slot_count) framed = normalmap_on_sphere(geometry->spheres + (slot[k] - geometry->slot_count), point, x, y);
//@end
