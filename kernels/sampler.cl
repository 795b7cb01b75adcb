// Provides: sampler_word: random words, a pure function of pixel, sample, dimension and seed, and uniform_from_word: a word as a number of [0, 1).
// Needs: lanes.cl.  Reads: REAL_BITS.
//
// | function          | algorithm                                             | source                     | error          |
// |-------------------|-------------------------------------------------------|----------------------------|----------------|
// | sampler_sobol     | Sobol's first two dimensions: a (0, 2)-sequence        | Joe and Kuo 2008           | none           |
// | sampler_permute   | a nested permutation of bits, from the lowest up      | Laine and Karras 2011;     | none           |
// |                   |                                                       | Burley 2020, listing 1     |                |
// | sampler_word      | Owen-scrambled Sobol, padded: each pair of dimensions | Owen 1995; Burley 2020,    | none           |
// |                   | shuffled and scrambled by itself                      | section 5                  |                |
// | uniform_from_word | the upper 24 bits (float64: all 32) times 2^-24 (-32) | Vigna 2014, "[0, 1) from   | none: each     |
// |                   |                                                       | upper bits"; Goualard 2020 | step is exact  |
//
// Dimensions: 0 and 1 the place in the pixel, 2 and 3 the place on the lens. clrt/reference/sampler.py gives the same words.

// Wellons 2018, "lowbias32": a bijection of words.
static inline uint sampler_mix(uint x) {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

static inline uint sampler_reverse(uint x) {
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    return (x >> 16) | (x << 16);
}

// Each bit is flipped or not by a hash of the key and the bits below it: the factors are even.
static inline uint sampler_permute(uint x, uint key) {
    x += key;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    return x ^ (x * 0x8d22f6e6u);
}

// Point `index` of Sobol's sequence with its bits reversed. Dimension 0 is the index itself. In dimension 1 direction number k has the
// binomials C(k, j) mod 2, which are 1 where the bits of j are among those of k (Lucas): bit j is the sum over all such k.
static inline uint sampler_sobol(uint index, uint dimension) {
    if (dimension == 0) return index;
    index ^= (index >> 1) & 0x55555555u;
    index ^= (index >> 2) & 0x33333333u;
    index ^= (index >> 4) & 0x0f0f0f0fu;
    index ^= (index >> 8) & 0x00ff00ffu;
    return index ^ (index >> 16);
}

// pixel : (row << 16) | column. Of 2^k samples from a multiple of 2^k on, each pair of dimensions (2i, 2i + 1) puts one into each
// elementary interval of area 2^-k.
static inline uint sampler_word(uint pixel, uint sample, uint dimension, uint seed) {
    const uint pair = dimension >> 1, component = dimension & 1;
    const uint key = sampler_mix(sampler_mix(sampler_mix(seed + 0x9e3779b9u) ^ pixel) + 0x9e3779b9u * (pair + 1));
    const uint index = sampler_reverse(sampler_permute(sampler_reverse(sample), sampler_mix(key ^ 0xa511e9b3u)));
    return sampler_reverse(sampler_permute(sampler_sobol(index, component), sampler_mix(key + component + 1)));
}

// word * 2^-32 in float32 rounds words from 2^32 - 128 on up to 1, where log(1 - u) is infinite and a table is read past its end.
// Here the greatest value is 1 - 2^-24 (1 - 2^-32), so 1 - u, exact as well, is never 0.
static inline real uniform_from_word(uint word) {
#if REAL_BITS == 64
    return word * 0x1p-32;
#else
    return (word >> 8) * 0x1p-24f;
#endif
}
