// Provides: lens_disc; rays from a place on a thin lens, uniform over its disc, through the point of the sharp plane that the pinhole's ray meets.
// Needs: sampler.cl.  Reads: nothing.
//
// `lens_right` and `lens_up` span the disc, `lens_axis` is the unit normal of the sharp plane over its distance: with d the pinhole's
// direction and p the place on the lens, the ray from p to d / (d.lens_axis) runs along d - (d.lens_axis) p.

// A square to a disc, without distorting areas: squares about the middle become circles (Shirley and Chiu 1997). x, y : -1 to 1.
static inline void lens_disc(real x, real y, real *to_right, real *to_up) {
    const int wide = fabs(x) > fabs(y);
    const real radius = wide ? x : y, other = wide ? y : x;
    const real angle = radius == R(0.0) ? R(0.0) : R(0.78539816339744831) * (other / radius);
    *to_right = radius * (wide ? cos(angle) : sin(angle));
    *to_up = radius * (wide ? sin(angle) : cos(angle));
}

//@hook sample_origin
    for (int k = 0; k < LANES; k++) {
        const real to_x = R(2.0) * uniform_from_word(sampler_word(pixel[k], sample, 2, seed)) - R(1.0);
        const real to_y = R(2.0) * uniform_from_word(sampler_word(pixel[k], sample, 3, seed)) - R(1.0);
        lens_disc(to_x, to_y, x + k, y + k);
    }
    const real_n to_right = load_lanes(x), to_up = load_lanes(y), slope = dot_uniform(rays->direction, frame->lens_axis);
    for (int a = 0; a < 3; a++) {
        const real_n place = to_right * frame->lens_right[a] + to_up * frame->lens_up[a];
        rays->origin[a] += place;
        rays->direction[a] -= slope * place;
    }
//@end
