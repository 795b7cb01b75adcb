// Provides: a bound on the radiance that one path brings after its first hit: fewer bright specks, and a picture that is darker than it should be.
// Needs: bounce.cl.  Reads: nothing.

//@hook channel
            if (current.depth_left < frame->depth) {
                const real_n bound = choose(is_greater(weight, (real_n)0), frame->radiance_clamp / weight, (real_n)INFINITY);
                seen = min_n(seen, bound);
            }
//@end
//@hook fog_seen
                if (current.depth_left < frame->depth)
                    seen = min_n(seen, choose(is_greater(weight, (real_n)0), frame->radiance_clamp / weight, (real_n)INFINITY));
//@end
