// Provides: lens_disc; rays from a place on a thin lens, uniform over its disc, through the point of the sharp plane that the pinhole's ray meets.
// Needs: sampler.cl.  Reads: nothing.
//
// `lens_right` and `lens_up` span the disc, `lens_axis` is the unit normal of the sharp plane over its distance: with d the pinhole's
// direction and p the place on the lens, the ray from p to d / (d.lens_axis) runs along d - (d.lens_axis) p.

// Sine and cosine for x in [-pi/4, pi/4], which need no reduction of their argument: Taylor's series, of which the next term is below u.
#if REAL_BITS == 64
#define SERIES 8
#else
#define SERIES 4
#endif
HOT void sine_cosine(real_n x, real_n *sine, real_n *cosine) {
    const real_n square = x * x;
    real_n s = (real_n)1, c = (real_n)1;
    #pragma unroll
    for (int n = SERIES; n > 0; n--) {
        s = multiply_add(square * (R(-1.0) / (real)(2 * n * (2 * n + 1))), s, (real_n)1);
        c = multiply_add(square * (R(-1.0) / (real)((2 * n - 1) * 2 * n)), c, (real_n)1);
    }
    *sine = x * s;
    *cosine = c;
}

// A square to a disc, without distorting areas: squares about the middle become circles (Shirley and Chiu 1997). x, y : -1 to 1.
HOT void lens_disc(real_n x, real_n y, real_n *to_right, real_n *to_up) {
    const mask_n wide = is_greater(abs_n(x), abs_n(y));
    const real_n radius = choose(wide, x, y), other = choose(wide, y, x);
    real_n sine, cosine;
    sine_cosine(R(0.78539816339744831) * (other / choose(is_equal(radius, (real_n)0), (real_n)1, radius)), &sine, &cosine);
    *to_right = radius * choose(wide, cosine, sine);
    *to_up = radius * choose(wide, sine, cosine);
}

//@hook sample_origin
    real_n across, upwards;
    sampler_pair(pixels, sample, 2, seed, &across, &upwards);
    const real_n slope = dot_uniform(rays->direction, frame->lens_axis);
    real_n to_right, to_up;
    lens_disc(R(2.0) * across - R(1.0), R(2.0) * upwards - R(1.0), &to_right, &to_up);
    for (int a = 0; a < 3; a++) {
        const real_n place = to_right * frame->lens_right[a] + to_up * frame->lens_up[a];
        rays->origin[a] += place;
        rays->direction[a] -= slope * place;
    }
//@end
