// Provides: environment_draw: directions drawn by the light that comes from them; environment_light: what hits get of that light.
// Needs: environment.cl, path.cl, scatter.cl, structs.  Reads: nothing.
//
// A row is drawn in proportion to the light of all of it, a cell of the row in proportion to its own, each by one word of 32 bits against the
// words at which rows and cells begin: chances are whole multiples of 2^-32, and what is drawn is what `chance` says, to the last bit. Within
// a cell the direction is even over the solid angle: evenly in longitude and in the height, the cosine. So `chance`, per solid angle, is
// constant within a cell, as the radiance is:
//     chance of the row * chance of the cell / solid angle of the cell,   all but the second in the row's `density`
#define ENVIRONMENT_WORDS 4294967296.0

// The last of `count` beginnings, `stride` words apart and rising, that is at most `word`; the first is 0.
HOT int environment_search(global const uint *beginnings, const int stride, const int count, const uint word) {
    int low = 0, high = count - 1;
    while (low < high) {
        const int middle = (low + high + 1) / 2;
        if (beginnings[(size_t)middle * stride] <= word) low = middle;
        else high = middle - 1;
    }
    return low;
}

// How many words stand for entry i of `count`.
HOT double environment_words(global const uint *beginnings, const int stride, const int count, const int i) {
    return (i + 1 < count ? beginnings[(size_t)(i + 1) * stride] : ENVIRONMENT_WORDS) - beginnings[(size_t)i * stride];
}

// With which density directions to a cell are drawn, per solid angle.
HOT real environment_chance(global const Frame *frame, global const EnvironmentRow *rows, global const uint *columns, const int cell) {
    const int width = frame->environment_width, row = cell / width, column = cell % width;
    if (column >= rows[row].lit) return R(0.0);
    return rows[row].density * (real)environment_words(columns + (size_t)row * width, 1, rows[row].lit, column);
}

// A unit vector a lane, its cell and chance.
static __attribute__((noinline)) void environment_draw(global const Frame *frame, global const EnvironmentRow *rows, global const uint *columns,
                                                       const Draws *draws, const uint path, real *direction, lane_int *cell, real *chance) {
    const int width = frame->environment_width, stride = sizeof(EnvironmentRow) / sizeof(uint), lit_rows = frame->environment_lit;
    global const uint *beginnings = (global const uint *)&rows->begin;
    word_n first, second;
    uint downs[LANES], rights[LANES];
    sampler_words(sampler_pixels(draws->pixel), draws->sample, 2 * (16 * path + USE_ENVIRONMENT), draws->seed, &first, &second);
    store_words(first, downs);
    store_words(second, rights);
    for (int k = 0; k < LANES; k++) {
        const uint down = downs[k], right = rights[k];
        const int j = environment_search(beginnings, stride, lit_rows, down);
        global const EnvironmentRow *row = rows + j;
        global const uint *cells = columns + (size_t)j * width;
        const int i = environment_search(cells, 1, row->lit, right);
        const double words = environment_words(cells, 1, row->lit, i);
        const double s = (down - (uint)row->begin + 0.5) / environment_words(beginnings, stride, lit_rows, j), t = (right - cells[i] + 0.5) / words;
        const double height = row->top + s * (row->bottom - row->top), radius = sqrt((1 - height) * (1 + height));
        const double turn = 2 * ((i + t) / width - 0.5 + frame->environment_turn);
        direction[k] = radius * sinpi(turn);
        direction[LANES + k] = height;
        direction[2 * LANES + k] = radius * cospi(turn);
        cell[k] = j * width + i;
        chance[k] = row->density * (real)words;
    }
}

// What the hits get of the light from one direction, drawn for each.
HOT void environment_light(const Geometry *geometry, global const Frame *frame, global const real *environment_cells,
                           global const EnvironmentRow *rows, global const uint *columns, global const Material *materials, const Draws *draws,
                           const uint path, const Rays *rays, const Hit *hit, const int from_eye, const int goes_on, real_n weight, Shade *shade) {
    real direction[3 * LANES], density[LANES];
    lane_int cell[LANES];
    environment_draw(frame, rows, columns, draws, path, direction, cell, density);
    const real_n chance = load_lanes(density);
    real_n to_light[3], power[3];
    for (int a = 0; a < 3; a++) to_light[a] = load_lanes(direction + a * LANES);
    mask_n lit = hit->found & is_greater(chance, (real_n)0);
    real_n amount = choose(lit, scatter_phong(geometry, materials, rays, hit, to_light, chance, goes_on), (real_n)0);
    mask_n wanted = is_greater(amount * weight, (real_n)0);
    //@ scatter_lobes
    lit &= wanted;
    if (!any_lane(lit)) return;
    for (int a = 0; a < 3; a++) {
        gather(power[a], environment_cells[3 * (size_t)cell[k] + a]);
        power[a] = choose(lit, power[a] / chance, (real_n)0);
    }
    //@ environment_visible
    //@ scatter_lit
    amount = choose(lit, amount, (real_n)0);
    for (int a = 0; a < 3; a++) shade->sum[a] += amount * power[a];
}

//@hook light
        if (HAVE_ENVIRONMENT_LIGHT && any_lane(hit.found)) {
            int from_eye = 1, goes_on = 0;
            //@ light_origin
            //@ light_draws
            environment_light(&geometry, frame, environment_cells, environment_rows, environment_columns, materials, &draws, path, &rays, &hit,
                              from_eye, goes_on, weight, &shade);
        }
//@end
