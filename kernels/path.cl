// Provides: Draws, path_pair: random numbers for what a packet's rays draw on their ways.
// Needs: sampler.cl, sampling.cl (sample, seed).  Reads: nothing.
//
// Each ray of a sample has a number, `path`: 1 for the eye's, and one by hashing for each that goes on from it. Pair 16 path + use of the
// sampler's dimensions serves one use at the hit of that ray; the pairs below 16 are those of the pixel, the lens and the time.
#define USE_LIGHT_POINT 0u
#define USE_LIGHT_PICK 1u    // and, second, roulette
#define USE_ENVIRONMENT 2u
#define USE_GLOSS 3u
#define USE_GLOSS_THROUGH 4u
#define USE_SCATTER 5u
#define USE_SCATTER_LOBE 6u  // and, second, the distance in fog
#define USE_FOG_POINT 7u
#define USE_FOG_PICK 8u

typedef struct {
    uint pixel;  // of lane 0, (row << 16) | column
    uint sample, seed;
} Draws;

// Two numbers of [0, 1) a lane.
HOT void path_pair(const Draws *draws, const uint path, const uint use, real_n *first, real_n *second) {
    sampler_pair(sampler_pixels(draws->pixel), draws->sample, 2 * (16 * path + use), draws->seed, first, second);
}

//@hook drawn
    const Draws draws = {((uint)row << 16) | (uint)column, sample, seed};
    uint path = 1;
//@end
