// Provides: Fresnel's equations at the facets of rough glass.
// Needs: gloss_refraction.cl, fresnel.cl.  Reads: nothing.

//@hook gloss_share
    if (material->fresnel) share = fresnel_dielectric(met, from, to);
//@end
