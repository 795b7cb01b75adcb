// Provides: shares of light samples and drawn rays on metal-rough surfaces.
// Needs: metal_rough_light.cl, metal_rough_ray.cl, mis.cl.  Reads: nothing.

//@hook metal_share
    if (goes_on) lobe *= mis_share(geometry, chance, lobe_chance);
//@end
//@hook shone_pushed
                shone->pdf = metal_chance;
//@end
