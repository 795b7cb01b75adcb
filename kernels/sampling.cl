// Provides: sampling_camera, sampling_store: one sample of each pixel, and the mean of those so far.
// Needs: sampler.cl, lanes.cl, rays.cl, structs.  Reads: PACKET_WIDTH, PACKET_HEIGHT (their product is LANES), TILE_WIDTH, TILE_HEIGHT.
//
// `sample_range` holds the number of the sample and how many were added up before. Sums are taken in float64, sample after sample, so
// they do not depend on how the picture is cut into launches; after n additions the relative error is below n 2^-53.
// Then comes the number of tiles, and column and row of the first pixel of each; none: rows as they are launched.

// The rays of camera_rays, moved from the pixel's centre and the eye by what effects add. `extent` is as in rays_prepare.
HOT void sampling_camera(global const Frame *frame, int column, int row, uint sample, uint seed, Rays *rays) {
    real x[LANES], y[LANES];
    uint pixel[LANES];
    for (int k = 0; k < LANES; k++) {
        x[k] = column + k % PACKET_WIDTH;
        y[k] = row + k / PACKET_WIDTH;
        pixel[k] = ((uint)(row + k / PACKET_WIDTH) << 16) | (uint)(column + k % PACKET_WIDTH);
    }
    const real_n px = load_lanes(x), py = load_lanes(y);
    rays->active = is_less(px, (real_n)frame->width) & is_less(py, (real_n)frame->height);
    real_n s = px + R(0.5), t = py + R(0.5);
    real extent = R(0.0);
    //@ sample_pixel
    s = s / (real)frame->width;
    t = t / (real)frame->height;
    for (int a = 0; a < 3; a++) {
        rays->origin[a] = (real_n)frame->eye_local[a];
        rays->direction[a] = frame->corner[a] + s * frame->along_row[a] + t * frame->along_column[a] + s * t * frame->twist[a];
    }
    //@ sample_origin
    const real_n scale = R(1.0) / sqrt(dot_n(rays->direction, rays->direction));
    for (int a = 0; a < 3; a++) rays->direction[a] *= scale;
    rays->t_min = (real_n)0;
    rays->t_max = (real_n)INFINITY;
    rays->skip = (mask_n)-1;
    rays_prepare(rays, extent);
}

static inline void sampling_store(global const int *sample_range, global double *sample_sums, size_t at, real value, global float *film) {
    const int before = sample_range[1];
    const double sum = (before > 0 ? sample_sums[at] : 0.0) + (double)value;
    sample_sums[at] = sum;
    film[at] = (float)(sum / (before + 1));
}

//@hook camera
    const uint sample = (uint)sample_range[0], seed = (uint)frame->seed;
    sampling_camera(frame, column, row, sample, seed, &rays);
//@end
//@hook store
        for (int a = 0; a < 3; a++) sampling_store(sample_range, sample_sums, 3 * ((size_t)y * frame->width + x) + a, out[a][k], film);
//@end
//@hook packet
    if (sample_range[2] > 0) {
        const int across = TILE_WIDTH / PACKET_WIDTH, packets = across * (TILE_HEIGHT / PACKET_HEIGHT);
        const int number = get_global_id(1) * get_global_size(0) + get_global_id(0), tile = number / packets, place = number % packets;
        if (tile >= sample_range[2]) return;
        column = sample_range[3 + 2 * tile] + place % across * PACKET_WIDTH;
        row = sample_range[4 + 2 * tile] + place / across * PACKET_HEIGHT;
    }
//@end
