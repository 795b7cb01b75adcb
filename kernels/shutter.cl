// Provides: shutter_times: when the samples of a packet of pixels are taken, uniform from opening to closing.
// Needs: sampler.cl, lanes.cl, structs.  Reads: nothing.
HOT real_n shutter_times(global const Frame *frame, int column, int row, uint sample, uint seed) {
    real_n time, other;
    sampler_pair(sampler_pixels(((uint)row << 16) | (uint)column), sample, 4, seed, &time, &other);
    return frame->shutter_open + time * frame->shutter_span;
}
