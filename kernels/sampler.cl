// Provides: word_n: a word a lane; sampler_words: random words, a pure function of pixel, sample, dimension and seed; uniform_from_words: words as
//           numbers of [0, 1); sampler_pair: two of them; sampler_pixels, load_words, store_words.
// Needs: lanes.cl.  Reads: REAL_BITS, LANES, PACKET_WIDTH.
//
// | function           | algorithm                                             | source                     | error          |
// |--------------------|-------------------------------------------------------|----------------------------|----------------|
// | sampler_sobol      | Sobol's first two dimensions: a (0, 2)-sequence        | Joe and Kuo 2008           | none           |
// | sampler_permute    | a nested permutation of bits, from the lowest up      | Laine and Karras 2011;     | none           |
// |                    |                                                       | Burley 2020, listing 1     |                |
// | sampler_words      | Owen-scrambled Sobol, padded: each pair of dimensions | Owen 1995; Burley 2020,    | none           |
// |                    | shuffled and scrambled by itself                      | section 5                  |                |
// | uniform_from_words | the upper 24 bits (float64: all 32) times 2^-24 (-32) | Vigna 2014, "[0, 1) from   | none: each     |
// |                    |                                                       | upper bits"; Goualard 2020 | step is exact  |
//
// Dimensions: 0 and 1 the place in the pixel, 2 and 3 the place on the lens. clrt/reference/sampler.py gives the same words.

#if LANES == 1
typedef uint word_n;
#define load_words(p) (*(p))
#define store_words(words, p) (*(p) = (words))
#define real_of_words(words) ((real)(int)(words))
#else
typedef PASTE(uint, LANES) word_n;
#define load_words(p) PASTE(vload, LANES)(0, p)
#define store_words(words, p) PASTE(vstore, LANES)(words, 0, p)
#define real_of_words(words) to_real_n(PASTE(as_int, LANES)(words))
#endif

// Wellons 2018, "lowbias32": a bijection of words.
HOT word_n sampler_mix(word_n x) {
    x = (x ^ (x >> 16)) * 0x7feb352du;
    x = (x ^ (x >> 15)) * 0x846ca68bu;
    return x ^ (x >> 16);
}

HOT word_n sampler_reverse(word_n x) {
    x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
    x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
    x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
    x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
    return (x >> 16) | (x << 16);
}

// Each bit is flipped or not by a hash of the key and the bits below it: the factors are even.
HOT word_n sampler_permute(word_n x, word_n key) {
    x += key;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    return x ^ (x * 0x8d22f6e6u);
}

// Point `index` of Sobol's sequence with its bits reversed. Dimension 0 is the index itself. In dimension 1 direction number k has the
// binomials C(k, j) mod 2, which are 1 where the bits of j are among those of k (Lucas): bit j is the sum over all such k.
HOT word_n sampler_sobol(word_n index, const uint dimension) {
    if (dimension == 0) return index;
    index ^= (index >> 1) & 0x55555555u;
    index ^= (index >> 2) & 0x33333333u;
    index ^= (index >> 4) & 0x0f0f0f0fu;
    index ^= (index >> 8) & 0x00ff00ffu;
    return index ^ (index >> 16);
}

// An even dimension and the next. pixel : (row << 16) | column. Of 2^k samples from a multiple of 2^k on, each pair of dimensions puts one
// into each elementary interval of area 2^-k. One copy: it is long, and asked for in many places.
static __attribute__((noinline)) void sampler_words(word_n pixel, uint sample, uint dimension, uint seed, word_n *first, word_n *second) {
    const uint pair = dimension >> 1;
    const word_n key = sampler_mix(sampler_mix(sampler_mix((word_n)(seed + 0x9e3779b9u)) ^ pixel) + 0x9e3779b9u * (pair + 1));
    const word_n index = sampler_reverse(sampler_permute(sampler_reverse((word_n)sample), sampler_mix(key ^ 0xa511e9b3u)));
    *first = sampler_reverse(sampler_permute(sampler_sobol(index, 0), sampler_mix(key + 1)));
    *second = sampler_reverse(sampler_permute(sampler_sobol(index, 1), sampler_mix(key + 2)));
}

// The pixels of a packet, of which lane 0 has the given one.
HOT word_n sampler_pixels(uint pixel) {
    uint of[LANES];
    for (int k = 0; k < LANES; k++) of[k] = pixel + (((uint)(k / PACKET_WIDTH) << 16) | (uint)(k % PACKET_WIDTH));
    return load_words(of);
}

// word * 2^-32 in float32 rounds words from 2^32 - 128 on up to 1, where log(1 - u) is infinite and a table is read past its end.
// Here the greatest value is 1 - 2^-24 (1 - 2^-32), so 1 - u, exact as well, is never 0.
HOT real_n uniform_from_words(word_n words) {
#if REAL_BITS == 64
    return real_of_words(words >> 1) * 0x1p-31 + real_of_words(words & 1u) * 0x1p-32;
#else
    return real_of_words(words >> 8) * 0x1p-24f;
#endif
}

// Two numbers of [0, 1) a lane, of an even dimension and the next.
HOT void sampler_pair(word_n pixel, uint sample, uint dimension, uint seed, real_n *first, real_n *second) {
    word_n one, other;
    sampler_words(pixel, sample, dimension, seed, &one, &other);
    *first = uniform_from_words(one);
    *second = uniform_from_words(other);
}
