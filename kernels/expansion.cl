// Provides: Expansion: exact sums and products of doubles as unevaluated sums; expansion_*.
// Needs: lanes.cl (FP_CONTRACT OFF: an error-free transformation must not be contracted).  Reads: nothing.
//
// | function               | what                        | source                                          | exact while                |
// |------------------------|-----------------------------|-------------------------------------------------|----------------------------|
// | two_sum, two_product   | x + y = a op b, x rounded   | Knuth 1969; Dekker 1971 by FMA                  | no overflow or underflow   |
// | expansion_add_scaled   | h += e * b                  | Shewchuk 1997: scale, expansion-sum, compress   | the same                   |
// | expansion_triple       | d . (p x q)                 | from the above                                  | the same                   |
//
// The first pass of Compress leaves components that are each at most half an ulp of the one before, the second no more of them; all
// are doubles, of which the exponents span 2098 bits: so there are at most 41, and 41 plus the 82 of a scaled one fit COMPONENTS. Inputs whose nonzero
// coordinate differences lie in [1e-40, 1e40] neither overflow nor underflow in the products of six of them taken here.
#define COMPONENTS 128
typedef struct {
    int count;             // 0 stands for the number 0
    double c[COMPONENTS];  // nonzero, nonoverlapping, by growing magnitude
} Expansion;

static inline void two_sum(double a, double b, double *x, double *y) {
    *x = a + b;
    const double part = *x - a;
    *y = (a - (*x - part)) + (b - part);
}
static inline void fast_two_sum(double a, double b, double *x, double *y) {
    *x = a + b;
    *y = b - (*x - a);
}
static inline void two_product(double a, double b, double *x, double *y) {
    *x = a * b;
    *y = fma(a, b, -*x);
}

// a - b, exactly.
static inline void expansion_difference(double a, double b, Expansion *e) {
    double high, low;
    two_sum(a, -b, &high, &low);
    e->count = 0;
    if (low != 0) e->c[e->count++] = low;
    if (high != 0) e->c[e->count++] = high;
}
static inline void expansion_single(double a, Expansion *e) {
    e->count = a != 0;
    e->c[0] = a;
}

// Shewchuk's Compress: the same number in the fewest components.
static inline void expansion_compress(Expansion *e) {
    if (e->count < 2) return;
    double sum = e->c[e->count - 1], rest;
    int bottom = e->count - 1;
    for (int i = e->count - 2; i >= 0; i--) {
        fast_two_sum(sum, e->c[i], &sum, &rest);
        if (rest != 0) {
            e->c[bottom--] = sum;
            sum = rest;
        }
    }
    int top = 0;
    for (int i = bottom + 1; i < e->count; i++) {
        fast_two_sum(e->c[i], sum, &sum, &rest);
        if (rest != 0) e->c[top++] = rest;
    }
    if (sum != 0) e->c[top++] = sum;
    e->count = top;
}

// h += b, for one number.
static inline void expansion_grow(Expansion *h, double b) {
    int top = 0;
    double sum = b, rest;
    for (int i = 0; i < h->count; i++) {
        two_sum(sum, h->c[i], &sum, &rest);
        if (rest != 0) h->c[top++] = rest;
    }
    if (sum != 0) h->c[top++] = sum;
    h->count = top;
}

static __attribute__((noinline)) void expansion_add_scaled(Expansion *h, const Expansion *e, double b) {
    if (e->count == 0 || b == 0) return;
    double carry, low, high, rest;
    two_product(e->c[0], b, &carry, &low);
    expansion_grow(h, low);
    for (int i = 1; i < e->count; i++) {
        two_product(e->c[i], b, &high, &low);
        two_sum(carry, low, &carry, &rest);
        expansion_grow(h, rest);
        fast_two_sum(high, carry, &carry, &rest);
        expansion_grow(h, rest);
    }
    expansion_grow(h, carry);
    expansion_compress(h);
}

static inline void expansion_add_product(Expansion *h, const Expansion *a, const Expansion *b, double sign) {
    for (int i = 0; i < b->count; i++) expansion_add_scaled(h, a, sign * b->c[i]);
}

// d . (p x q)
static __attribute__((noinline)) void expansion_triple(const Expansion *d, const Expansion *p, const Expansion *q, Expansion *result) {
    Expansion cross;
    result->count = 0;
    for (int a = 0; a < 3; a++) {
        const int b = (a + 1) % 3, c = (a + 2) % 3;
        cross.count = 0;
        expansion_add_product(&cross, p + b, q + c, 1.0);
        expansion_add_product(&cross, p + c, q + b, -1.0);
        expansion_add_product(result, &cross, d + a, 1.0);
    }
}

static inline int expansion_sign(const Expansion *e) { return e->count == 0 ? 0 : e->c[e->count - 1] > 0 ? 1 : -1; }

// The nearest double but for an ulp.
static inline double expansion_value(const Expansion *e) {
    double sum = 0;
    for (int i = 0; i < e->count; i++) sum += e->c[i];
    return sum;
}
