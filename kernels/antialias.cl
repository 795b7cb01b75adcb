// Provides: the place of a sample in its pixel, uniform over the pixel's square (a box filter).
// Needs: sampler.cl, sampling.cl.  Reads: nothing.
//
// `pixel_spread` is 1, or 0 for a picture of one sample: the pixel's centre.

//@hook sample_pixel
    for (int k = 0; k < LANES; k++) {
        x[k] = uniform_from_word(sampler_word(pixel[k], sample, 0, seed)) - R(0.5);
        y[k] = uniform_from_word(sampler_word(pixel[k], sample, 1, seed)) - R(0.5);
    }
    s += frame->pixel_spread * load_lanes(x);
    t += frame->pixel_spread * load_lanes(y);
//@end
