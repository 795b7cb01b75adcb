// Provides: fog_mote: where light is scattered into rays by fog; fog_phase; what fog leaves of a ray.
// Needs: path.cl, hit.cl, structs.  Reads: HAVE_FOG.
//
// A way of length t leaves exp(-density t). Along a ray one place is drawn, at a distance of density density * exp(-density s) (inversion: s = -log(1 - u) / density):
// where it lies before the hit, what is scattered there reaches the ray's origin with the weight albedo alone. 1 - u is exact and not 0.
#define FOG_NO_SLOT 0x7ffffff0  // of no primitive

// Henyey and Greenstein (1941), per solid angle: `cosine` of the angle by which light is turned.
HOT real_n fog_phase(const real g, real_n cosine) {
    const real_n around = max_n(R(1.0) + g * g - R(2.0) * g * cosine, (real_n)((R(1.0) - fabs(g)) * (R(1.0) - fabs(g))));
    return (R(1.0) - g * g) * R(0.0795774715459476679) / (around * sqrt(around));
}

// The places drawn, as hits of nothing: off by the rounding of the ray's point.
HOT void fog_mote(global const Frame *frame, const Draws *draws, const uint path, const Rays *rays, real_n t_hit, real_n weight, Hit *mote) {
    real_n unused, u;
    path_pair(draws, path, USE_SCATTER_LOBE, &unused, &u);
    const real_n s = -log(R(1.0) - u) / frame->fog_density;
    mote->found = rays->active & is_less(s, t_hit) & is_greater(weight, (real_n)0);
    const real_n t = choose(mote->found, s, (real_n)0);
    for (int a = 0; a < 3; a++) mote->point[a] = ray_point(rays, t, a);
    mote->error = (R(8.0) * UNIT_ROUNDOFF) * (rays->scale + t);
    for (int k = 0; k < LANES; k++) {
        mote->slot[k] = FOG_NO_SLOT;
        mote->material[k] = 0;
    }
}

//@hook geometry_members
    real fog_density;
//@end
//@hook begin
    geometry.fog_density = frame->fog_density;
//@end
//@hook arrived
        if (HAVE_FOG) {
            real_n fog_weight[3] = {weight, weight, weight}, misty[3] = {(real_n)0, (real_n)0, (real_n)0};
            Hit mote = {{0}};
            fog_mote(frame, &draws, path, &rays, hits.t, weight, &mote);
            //@ fog_tint
            if (any_lane(mote.found)) {
                //@ fog_lights
            }
            for (int a = 0; a < 3; a++) {
                const real_n weight = fog_weight[a];
                real_n seen = frame->fog_albedo[a] * misty[a];
                //@ fog_seen
                color[a] += choose(mote.found, weight * seen, (real_n)0);
            }
            weight *= exp(-frame->fog_density * hits.t);
        }
//@end
//@hook planar
    planar &= is_less(load_lanes(hit->slot), (mask_n)geometry->slot_count);
//@end
