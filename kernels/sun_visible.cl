// Provides: what stands between hits and suns.
// Needs: sun.cl, reach.cl.  Reads: nothing.

//@hook sun_visible
        lit = reach_clear(geometry, rays, hit, to_light, from_eye, extent, lit);
//@end
