// Provides: what media leave of light on its way from where fog scatters it.
// Needs: fog.cl, absorb.cl.  Reads: nothing.

//@hook fog_tint
            absorb_along(&current.media, media, absorption, &rays, &mote, fog_weight);
//@end
