// Provides: shutter_times: when the samples of a packet of pixels are taken, uniform from opening to closing.
// Needs: sampler.cl, lanes.cl, structs.  Reads: PACKET_WIDTH.
HOT real_n shutter_times(global const Frame *frame, int column, int row, uint sample, uint seed) {
    real time[LANES];
    for (int k = 0; k < LANES; k++) {
        const uint pixel = ((uint)(row + k / PACKET_WIDTH) << 16) | (uint)(column + k % PACKET_WIDTH);
        time[k] = uniform_from_word(sampler_word(pixel, sample, 4, seed));
    }
    return frame->shutter_open + load_lanes(time) * frame->shutter_span;
}
