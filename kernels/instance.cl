// Provides: instance_rays, instance_point, instance_normal, instance_to_object, instance_to_world: to and from the space of an object that is scaled and turned.
// Needs: hit.cl, geometry.cl, structs.  Reads: nothing.
//
// `object_from_world` holds three rows of four numbers in float64: points of the world relative to the local origin become points of the object relative
// to its own. Normals come back by its transpose; the one scale that smooth triangles allow is 1 / |row|.
HOT void instance_rays(global const Placement *from, const Rays *rays, Rays *inner, real_n *length) {
    double_n origin[3], direction[3];
    for (int a = 0; a < 3; a++) {
        origin[a] = to_double_n(rays->origin[a]);
        direction[a] = to_double_n(rays->direction[a]);
    }
    for (int a = 0; a < 3; a++) {
        global const double *row = from->object_from_world + 4 * a;
        inner->origin[a] = to_real_n(row[0] * origin[0] + row[1] * origin[1] + row[2] * origin[2] + row[3]);
        inner->direction[a] = to_real_n(row[0] * direction[0] + row[1] * direction[1] + row[2] * direction[2]);
    }
    *length = sqrt(dot_n(inner->direction, inner->direction));
    const real_n scale = R(1.0) / *length;
    for (int a = 0; a < 3; a++) inner->direction[a] *= scale;
}

HOT void instance_point(global const Placement *from, double *at) {
    const double x = at[0], y = at[1], z = at[2];
    for (int a = 0; a < 3; a++) {
        global const double *row = from->object_from_world + 4 * a;
        at[a] = row[0] * x + row[1] * y + row[2] * z + row[3];
    }
}

// A vector of the object's space that is perpendicular to its surface becomes one that is so in the world, not of unit length; gives its length.
HOT double instance_normal(global const Placement *from, real n[3][LANES], const int k) {
    double turned[3], square = 0;
    for (int a = 0; a < 3; a++) {
        turned[a] = 0;
        for (int b = 0; b < 3; b++) turned[a] += from->object_from_world[4 * b + a] * n[b][k];
        square += turned[a] * turned[a];
    }
    const double length = sqrt(square);
    for (int a = 0; a < 3; a++) n[a][k] = (real)(turned[a] / length);
    return length;
}

// Vectors to the object's space at their own length, and from there, grown by the one scale s of the transform: s M v and s^2 M^T v.
HOT void instance_to_object(global const Placement *from, real v[3][LANES], const int k) {
    global const double *row = from->object_from_world;
    const double scale = 1 / sqrt(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]), x = v[0][k], y = v[1][k], z = v[2][k];
    for (int a = 0; a < 3; a++) v[a][k] = (real)(scale * (row[4 * a] * x + row[4 * a + 1] * y + row[4 * a + 2] * z));
}

HOT void instance_to_world(global const Placement *from, real v[3][LANES], const int k) {
    global const double *row = from->object_from_world;
    const double square = 1 / (row[0] * row[0] + row[1] * row[1] + row[2] * row[2]), x = v[0][k], y = v[1][k], z = v[2][k];
    for (int a = 0; a < 3; a++) v[a][k] = (real)(square * (row[a] * x + row[4 + a] * y + row[8 + a] * z));
}

//@hook placed_enter
        instance_rays(from, rays, &inner, &length);
//@end
//@hook placed_point
        instance_point(from, at);
//@end
//@hook placed_normal
        stretch = instance_normal(from, geometric, k);
        instance_normal(from, normal, k);
        longest = from->stretch;
//@end
//@hook placed_to_object
        instance_to_object(from, vector, k);
//@end
//@hook placed_to_world
        instance_to_world(from, vector, k);
//@end
