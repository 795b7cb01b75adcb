// Provides: which hits see the directions that the environment lights them from.
// Needs: environment_light.cl, reach.cl.  Reads: nothing.

//@hook environment_visible
    lit = reach_clear(geometry, rays, hit, to_light, from_eye, frame->extent, lit);
//@end
