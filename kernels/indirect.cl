// Provides: indirect_scatter: rays that a surface's own reflection sends on, for light from surface to surface (Kajiya 1986).
// Needs: bounce.cl, path.cl, throughput.cl, hit.cl, structs.  Reads: nothing.
//
// Phong's reflection is drawn in proportion to itself: f cos = C (Kd N.L + Ks (R.V)^n) / pi has the parts Kd and 2 Ks / (n + 1) in all; a direction comes
// from the first, cosine about N, or from the second, (R.V)^n about the mirrored ray. So C (Kd + 2 Ks / (n + 1)) is the ray's weight, whatever
// the direction; one that leads below the surface is lost. From the third such ray on, roulette keeps a ray with its weight as the chance
// (Arvo and Kirk 1990), so that no bias comes of it.
#define INDIRECT_SURE_RAYS 2
#define INDIRECT_LEAST_CHANCE R(0.05)  // bounds what a ray that was kept weighs

// A unit vector at the cosine `c` from `axis`, the angle `turn` around it in half turns (frame: Duff and others 2017).
HOT void indirect_about(const real_n *axis, real_n c, real_n turn, real_n *direction) {
    const real_n sign = choose(is_less(axis[2], (real_n)0), (real_n)-1, (real_n)1), q = R(-1.0) / (sign + axis[2]), b = axis[0] * axis[1] * q;
    const real_n s = sqrt(max_n((R(1.0) - c) * (R(1.0) + c), (real_n)0)), x = s * cospi(turn), y = s * sinpi(turn);
    direction[0] = x * (R(1.0) + sign * axis[0] * axis[0] * q) + y * b + c * axis[0];
    direction[1] = x * (sign * b) + y * (sign + axis[1] * axis[1] * q) + c * axis[1];
    direction[2] = -x * (sign * axis[0]) - y * axis[1] + c * axis[2];
}

// What Phong's reflection hands on in all, without the surface's colour, and the part of it that is the highlight.
HOT real_n indirect_total(global const Material *materials, const Hit *hit, real_n *exponent, real_n *highlight) {
    real_n diffuse, specular;
    gather(diffuse, materials[hit->material[k]].diffuse);
    gather(specular, materials[hit->material[k]].specular);
    gather(*exponent, materials[hit->material[k]].exponent);
    const real_n shine = R(2.0) * specular / (*exponent + R(1.0)), total = diffuse + shine;
    *highlight = choose(is_greater(total, (real_n)0), shine / total, (real_n)0);
    return total;
}

// The density, per solid angle, with which `direction` is drawn; 0 below the surface.
HOT real_n indirect_density(const Rays *rays, const Hit *hit, const real_n *direction, real_n exponent, real_n highlight) {
    const real_n cosine = dot_n(hit->normal, direction), cos_view = dot_n(hit->normal, rays->direction);
    const real_n cos_reflected = dot_n(direction, rays->direction) - R(2.0) * cosine * cos_view;
    const mask_n shiny = is_greater(highlight, (real_n)0) & is_greater(cos_reflected, (real_n)0);
    real_n density = (R(1.0) - highlight) * cosine;
    if (any_lane(shiny))
        density += choose(shiny, highlight * R(0.5) * (exponent + R(1.0)) * pow(choose(shiny, cos_reflected, (real_n)1), exponent), (real_n)0);
    const mask_n above = is_greater(cosine, (real_n)0) & is_greater(dot_n(hit->geometric, direction), (real_n)0);
    return choose(above, density * R(0.318309886183790672), (real_n)0);
}

// Draws `direction`; gives its density, 0 where it is lost, and in `total` the ray's weight but for the surface's colour.
HOT real_n indirect_scatter(global const Material *materials, const Draws *draws, const uint path, const Rays *rays, const Hit *hit,
                            real_n *direction, real_n *total) {
    real_n u, v, lobe, unused, exponent, highlight, axis[3], mirrored[3];
    path_pair(draws, path, USE_SCATTER, &u, &v);
    path_pair(draws, path, USE_SCATTER_LOBE, &lobe, &unused);
    *total = indirect_total(materials, hit, &exponent, &highlight);
    const real_n twice = R(2.0) * dot_n(rays->direction, hit->normal);
    const mask_n shiny = is_less(lobe, highlight);
    for (int a = 0; a < 3; a++) {
        mirrored[a] = rays->direction[a] - twice * hit->normal[a];
        axis[a] = choose(shiny, mirrored[a], hit->normal[a]);
    }
    real_n c = sqrt(u);
    if (any_lane(shiny)) c = choose(shiny, pow(u, R(1.0) / (exponent + R(1.0))), c);
    indirect_about(axis, c, R(2.0) * v, direction);
    normalize_n(direction);
    return indirect_density(rays, hit, direction, exponent, highlight);
}

//@hook shade_begin
        if (HAVE_INDIRECT) ambient = (real_n)0;  // stands for what is traced here
        real_n surface_color[3];
//@end
//@hook channel
            surface_color[a] = albedo;
//@end
//@hook spawn
        if (HAVE_INDIRECT && current.depth_left > 0) {
            real_n direction[3], total;
            const real_n chance = indirect_scatter(materials, &draws, path, &rays, &hit, direction, &total);
            mask_n kept = hit.found & is_greater(chance, (real_n)0) & is_greater(weight * total, (real_n)0);
            real_n left[3], most = (real_n)0;
            for (int a = 0; a < 3; a++) {
                left[a] = current.tint[a] * surface_color[a] * total;
                most = max_n(most, left[a] * weight);
            }
            kept &= is_greater(most, (real_n)0);
            if (frame->depth - current.depth_left >= INDIRECT_SURE_RAYS) {
                real_n unused, u;
                path_pair(&draws, path, USE_LIGHT_PICK, &unused, &u);
                const real_n stays = min_n(max_n(most, (real_n)INDIRECT_LEAST_CHANCE), (real_n)1);
                kept &= is_less(u, stays);
                for (int a = 0; a < 3; a++) left[a] /= stays;
            }
            if (any_lane(kept)) {
                Bounce *drawn = bounce_push(&geometry, &rays, &bounces, &hit, direction, weight, kept, &current, BRANCH_SCATTERED);
                for (int a = 0; a < 3; a++) drawn->tint[a] = left[a];
                //@counting count_rays(counters, COUNT_INDIRECT, kept);
                //@ drawn_pushed
                //@ scattered_pushed
            }
        }
//@end
//@hook scatter_share
    // Directions that scattered rays draw, too.
    if (HAVE_INDIRECT && goes_on) {
        real_n scatter_exponent, highlight;
        indirect_total(materials, hit, &scatter_exponent, &highlight);
        real_n density = indirect_density(rays, hit, to_light, scatter_exponent, highlight);
        //@ scattered_density
        amount *= mis_share(geometry, chance, density);
    }
//@end
