// Provides: what surfaces let through of the light that fog scatters.
// Needs: fog.cl, opacity_shadow.cl.  Reads: nothing.

//@hook fog_lit
        amount *= *geometry->let_through;
//@end
