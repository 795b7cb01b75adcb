// Provides: what a group's rays from the eye meet, for all its packets at once: shadow rays of these go together.
// Needs: group.cl, surface.cl.  Reads: GROUP.
//
// Without lights each packet finds out for itself (render.cl), and normals that nobody asks for are not loaded.

//@hook group_seen
    Hit eye_hit[GROUP];
    for (int p = 0; p < GROUP; p++) hit_surface(&geometry, frame, surfaces, eye_rays + p, eye_hits + p, eye_hit + p);
//@end
//@hook seen_parameters
                   , const Hit *eye_hit
//@end
//@hook seen_arguments
                      , eye_hit + p
//@end
//@hook eye_rays
    int from_group = 1;  // whether what the group has found is this round's
//@end
//@hook surface
        if (from_group) hit = *eye_hit;
        else hit_surface(&geometry, frame, surfaces, &rays, &hits, &hit);
        //@ surface_seen
        from_group = 0;
//@end
