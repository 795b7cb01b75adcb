// Provides: what stands between hits and suns.
// Needs: sun.cl, reach.cl.  Reads: nothing.

//@hook sun_visible
        mask_n clear = NO_LANES;
        //@ sun_known
        if (any_lane(lit)) lit = reach_clear(geometry, rays, hit, to_light, from_eye, extent, lit);
        lit |= clear;
//@end
