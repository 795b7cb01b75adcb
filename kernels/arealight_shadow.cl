// Provides: the soft shadows of area lights.
// Needs: arealight.cl, reach.cl.  Reads: nothing.

//@hook arealight_visible
    lit &= is_greater(t_max, (real_n)0);
    lit = reach_clear(geometry, rays, hit, to_light, t_max, from_eye, frame->extent, lit);
//@end
