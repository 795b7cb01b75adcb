// Provides: environment_find: the cells of the environment's picture that rays point to; what rays bring that meet nothing.
// Needs: hit.cl, rays.cl, structs.  Reads: nothing.
//
// | function         | algorithm                                   | error                                                                 |
// |------------------|---------------------------------------------|-----------------------------------------------------------------------|
// | environment_find | longitude and latitude, both by arctangents | 2^-48 of a turn, besides the direction's own, at the poles, too, where |
// |                  | of two lengths, in float64                  | an arcsine of the height would lose half of the digits                |
//
// Within a cell the radiance is constant; its edges are decisions with that margin.

// The number of the cell for each ray in `wanted`, 0 for others. Scalar work: arctangents of vectors would go lane by lane as well.
static __attribute__((noinline)) void environment_find(global const Frame *frame, const real *direction, const lane_int *wanted, lane_int *cell) {
    const int width = frame->environment_width, height = frame->environment_height;
    for (int k = 0; k < LANES; k++) {
        cell[k] = 0;
        if (!wanted[k]) continue;
        const double x = direction[k], y = direction[LANES + k], z = direction[2 * LANES + k];
        // Quotients by pi as rounded: a quarter of a turn is 0.25 to the last digit.
        const double u = 0.5 + atan2(x, z) / (2 * M_PI) - frame->environment_turn, v = atan2(sqrt(x * x + z * z), y) / M_PI;
        const int column = (int)((u - floor(u)) * width), row = (int)(v * height);
        cell[k] = min(row, height - 1) * width + min(column, width - 1);
    }
}

//@hook light
        const mask_n escaped = HAVE_ENVIRONMENT ? rays.active & ~hit.found : (mask_n)0;
        real_n sky[3] = {(real_n)0, (real_n)0, (real_n)0};
        if (any_lane(escaped)) {
            real direction[3 * LANES];
            lane_int wanted[LANES], cell[LANES];
            for (int a = 0; a < 3; a++) store_lanes(rays.direction[a], direction + a * LANES);
            store_lanes(escaped, wanted);
            environment_find(frame, direction, wanted, cell);
            for (int a = 0; a < 3; a++) gather(sky[a], environment_cells[3 * (size_t)cell[k] + a]);
            //@ environment_met
        }
//@end
//@hook channel
            if (HAVE_ENVIRONMENT) seen = choose(hit.found, seen, sky[a]);
//@end
