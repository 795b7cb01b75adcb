// Provides: falloff_factor: what is left at a hit point of the light of a lamp that falls off with the square of the distance.
// Needs: lanes.cl, hit.cl, structs.  Reads: nothing.

// 1 for a lamp that does not fall off. At the lamp itself it is infinite; such a hit is not lit.
HOT real_n falloff_factor(global const Light *light, const real_n *point) {
    if (light->falloff == 0) return (real_n)1;
    real_n way[3];
    for (int a = 0; a < 3; a++) way[a] = light->position[a] - point[a];
    return (real_n)1 / dot_n(way, way);
}

//@hook light_amount
        amount *= falloff_factor(light, hit->point);
//@end
