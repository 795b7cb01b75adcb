// Provides: spot_factor: how much of a lamp's light its cone lets through towards a hit point.
// Needs: lanes.cl, structs.  Reads: nothing.

// Of the angle between the cone's axis and the way to the point, h = 1 - cos, taken as half the square of the chord between the two unit
// vectors: off by 4u times the angle, where 1 - (a product of vectors) would be off by 4u. The factor rises gently, s^2 (3 - 2s), with
// s = (edge - h) * slope from 0 at the cone's edge to 1 at its bright part. A point light has edge 3: bright all around.
HOT real_n spot_factor(global const Light *light, const real_n *to_light) {
    real_n chord[3];
    for (int a = 0; a < 3; a++) chord[a] = to_light[a] + light->axis[a];
    const real_n rise = (light->edge - R(0.5) * dot_n(chord, chord)) * light->slope;
    const real_n s = min_n(max_n(rise, (real_n)0), (real_n)1);
    return s * s * (R(3.0) - R(2.0) * s);
}

//@hook light_amount
        amount *= spot_factor(light, to_light);
//@end
