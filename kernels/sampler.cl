// Provides: uniform_from_word: a random word as a number of [0, 1).
// Needs: lanes.cl.  Reads: REAL_BITS.
//
// | function          | algorithm                                            | source                   | error          |
// |-------------------|------------------------------------------------------|--------------------------|----------------|
// | uniform_from_word | the upper 24 bits (float64: all 32) times 2^-24 (-32) | Vigna 2014, "[0, 1) from | none: each     |
// |                   |                                                      | upper bits"; Goualard 2020 | step is exact |
//
// word * 2^-32 in float32 rounds words from 2^32 - 128 on up to 1, where log(1 - u) is infinite and a table is read past its end.
// Here the greatest value is 1 - 2^-24 (1 - 2^-32), so 1 - u, exact as well, is never 0.
static inline real uniform_from_word(uint word) {
#if REAL_BITS == 64
    return word * 0x1p-32;
#else
    return (word >> 8) * 0x1p-24f;
#endif
}
