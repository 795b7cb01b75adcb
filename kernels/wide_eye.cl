// Provides: what else there is to rays from the eye that do not share their origin: they are tested as rays of any origin are.
// Needs: sampling.cl, scene.cl.  Reads: nothing.

//@hook sample_origin
    if (HAVE_WIDE_EYE) extent = frame->extent;
//@end
//@hook sample_ready
    if (HAVE_WIDE_EYE) rays_invert(rays);
//@end
//@hook trace_default
        if (HAVE_WIDE_EYE) {
            scene_trace(&geometry, &rays, SHARED_NOTHING, 0, &hits);
        } else {
            //@ eye_trace
        }
//@end
//@hook bounce_begin
    if (HAVE_WIDE_EYE) current.from_eye = 0;
//@end
//@hook light_origin
            if (HAVE_WIDE_EYE) from_eye = 0;
//@end
//@hook single_begin
    geometry.looked_at = HAVE_WIDE_EYE;
//@end
