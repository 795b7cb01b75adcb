// Provides: what surfaces in the way leave of the light of lamps and suns on metal-rough materials.
// Needs: metal_rough.cl, opacity_shadow.cl.  Reads: nothing.

//@hook light_lit
        metal_power *= *geometry->let_through;
//@end
