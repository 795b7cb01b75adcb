// Provides: the soft shadows of area lights.
// Needs: arealight.cl, reach.cl.  Reads: nothing.

//@hook arealight_visible
    lit = reach_point(geometry, rays, hit, to_light, end, load_lanes(short_by), from_eye, frame->extent, lit);
//@end
