// Provides: sampling_camera, sampling_store: one sample of each pixel, and the mean of those so far.
// Needs: sampler.cl, lanes.cl, rays.cl, structs.  Reads: PACKET_WIDTH, PACKET_HEIGHT (their product is LANES), ITEM_WIDTH, ITEM_HEIGHT, TILE_WIDTH, TILE_HEIGHT.
//
// `sample_range` holds the first sample and the one behind the last, all of which a launch adds up pixel by pixel, then the number of tiles;
// none: rows as they are launched. Of each tile four words follow: column and row of its first pixel, which are multiples of a tile's width
// and height, the seed, and the place of its sums, counted in tiles: there they lie tile by tile.
// Sums are taken in float64, sample after sample, so they do not depend on how the picture is cut into launches; after n additions the
// relative error is below n 2^-53.

// The rays of camera_rays, moved from the pixel's centre and the eye by what effects add. `extent` is as in rays_check.
HOT void sampling_camera(global const Frame *frame, int column, int row, uint sample, uint seed, Rays *rays) {
    real x[LANES], y[LANES];
    const word_n pixels = sampler_pixels(((uint)row << 16) | (uint)column);
    for (int k = 0; k < LANES; k++) {
        x[k] = column + k % PACKET_WIDTH;
        y[k] = row + k / PACKET_WIDTH;
    }
    const real_n px = load_lanes(x), py = load_lanes(y);
    rays->active = is_less(px, (real_n)frame->width) & is_less(py, (real_n)frame->height);
    real_n s = px + R(0.5), t = py + R(0.5);
    real extent = R(0.0);
    //@ sample_pixel
    s = s / (real)frame->width;
    t = t / (real)frame->height;
    #pragma unroll
    for (int a = 0; a < 3; a++) {
        rays->origin[a] = (real_n)frame->eye_local[a];
        rays->direction[a] = frame->corner[a] + s * frame->along_row[a] + t * frame->along_column[a] + s * t * frame->twist[a];
    }
    //@ sample_origin
    const real_n scale = R(1.0) / sqrt(dot_n(rays->direction, rays->direction));
    #pragma unroll
    for (int a = 0; a < 3; a++) rays->direction[a] *= scale;
    rays->t_min = (real_n)0;
    rays->t_max = (real_n)INFINITY;
    rays->skip = (mask_n)-1;
    rays_check(rays, extent);
    //@ sample_ready
}

// Sample 0 begins the sum.
static inline double sampling_add(uint sample, global double *sum, real value) {
    return *sum = (sample > 0 ? *sum : 0.0) + (double)value;
}

//@hook packet
    uint seed = (uint)frame->seed;
    size_t tile_at = 0;
    if (sample_range[2] > 0) {
        const int across = TILE_WIDTH / ITEM_WIDTH, items = across * (TILE_HEIGHT / ITEM_HEIGHT);
        const int number = get_global_id(1) * get_global_size(0) + get_global_id(0), tile = number / items, place = number % items;
        if (tile >= sample_range[2]) return;
        global const int *given = sample_range + 3 + 4 * tile;
        column = given[0] + place % across * ITEM_WIDTH;
        row = given[1] + place / across * ITEM_HEIGHT;
        seed = (uint)given[2];
        tile_at = (size_t)given[3] * (TILE_WIDTH * TILE_HEIGHT);
    }
//@end
//@hook repeat
    for (uint sample = (uint)sample_range[0]; sample < (uint)sample_range[1]; sample++)
//@end
//@hook packet_parameters
                   , const uint sample, const uint seed, const size_t tile_at
//@end
//@hook packet_arguments
                  , sample, seed, tile_at
//@end
//@hook camera
    sampling_camera(frame, column, row, sample, seed, &rays);
//@end
//@hook film_ahead
    // What is added to is read, and waited for, in any case.
//@end
//@hook film
    for (int k = 0; k < LANES; k++) {
        const int x = column + k % PACKET_WIDTH, y = row + k / PACKET_WIDTH;
        if (x >= frame->width || y >= end_row) continue;
        const size_t at = (size_t)y * frame->width + x, in_tile = tile_at + y % TILE_HEIGHT * TILE_WIDTH + x % TILE_WIDTH;
        for (int a = 0; a < 3; a++) {
            if (sample_range[2] > 0) {
                sampling_add(sample, sample_sums + 3 * in_tile + a, out[a][k]);
            } else {
                film[3 * at + a] = (float)(sampling_add(sample, sample_sums + 3 * at + a, out[a][k]) / (sample + 1));
            }
        }
    }
//@end
