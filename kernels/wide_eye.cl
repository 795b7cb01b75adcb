// Provides: what else there is to rays from the eye that do not share their origin: they are tested as rays of any origin are.
// Needs: sampling.cl, scene.cl.  Reads: nothing.

//@hook sample_origin
    extent = frame->extent;
//@end
//@hook trace_default
        scene_trace(&geometry, &rays, 0, 0, &hits);
//@end
//@hook bounce_begin
    current.from_eye = 0;
//@end
//@hook light_origin
            from_eye = 0;
//@end
