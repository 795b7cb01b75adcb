// Provides: the place of a sample in its pixel, uniform over the pixel's square (a box filter).
// Needs: sampler.cl, sampling.cl.  Reads: nothing.
//
// `pixel_spread` is 1, or 0 for a picture of one sample: the pixel's centre.

//@hook sample_pixel
    real_n across_pixel, down_pixel;
    sampler_pair(pixels, sample, 0, seed, &across_pixel, &down_pixel);
    s += frame->pixel_spread * (across_pixel - R(0.5));
    t += frame->pixel_spread * (down_pixel - R(0.5));
//@end
