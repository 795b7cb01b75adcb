// Provides: shares where light samples pass what drawn rays do not, surfaces that are only in part in the way of light: all falls to light samples.
// Needs: mis.cl.  Reads: nothing.

//@hook mis_of_lights
    //@ mis_frame
    if (HAVE_LIGHTS_ALONE) share = (real_n)1;
//@end
//@hook mis_of_drawn
    //@ mis_frame
    if (HAVE_LIGHTS_ALONE) share = (real_n)0;
//@end
