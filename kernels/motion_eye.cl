// Provides: an eye that moves while the shutter is open.
// Needs: shutter.cl, sampling.cl.  Reads: nothing.

//@hook sample_origin
    const real_n eye_time = shutter_times(frame, column, row, sample, seed);
    for (int a = 0; a < 3; a++) rays->origin[a] += eye_time * frame->eye_motion[a];
//@end
