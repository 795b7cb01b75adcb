// Provides: camera_rays: the primary rays of one packet of pixels.
// Needs: lanes.cl, rays.cl, structs.  Reads: PACKET_WIDTH, PACKET_HEIGHT (their product is LANES).

// Rays through the centres of the pixels from (column, row) on; pixels outside the picture are inactive. Not inverted (rays.cl).
HOT void camera_rays(global const Frame *frame, int column, int row, Rays *rays) {
    real x[LANES], y[LANES];
    for (int k = 0; k < LANES; k++) {
        x[k] = column + k % PACKET_WIDTH;
        y[k] = row + k / PACKET_WIDTH;
    }
    const real_n px = load_lanes(x), py = load_lanes(y);
    const real_n s = (px + R(0.5)) / (real)frame->width, t = (py + R(0.5)) / (real)frame->height;
    rays->active = is_less(px, (real_n)frame->width) & is_less(py, (real_n)frame->height);
    #pragma unroll
    for (int a = 0; a < 3; a++) {
        rays->origin[a] = (real_n)frame->eye_local[a];
        rays->direction[a] = frame->corner[a] + s * frame->along_row[a] + t * frame->along_column[a] + s * t * frame->twist[a];
    }
    const real_n scale = R(1.0) / sqrt(dot_n(rays->direction, rays->direction));
    #pragma unroll
    for (int a = 0; a < 3; a++) rays->direction[a] *= scale;
    rays->t_min = (real_n)0;
    rays->t_max = (real_n)INFINITY;
    rays->skip = (mask_n)-1;
    rays_check(rays, R(0.0));
}
