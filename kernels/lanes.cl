// Provides: real, real_n, mask_n, double_n (LANES rays side by side), R(), choose, min_n, max_n, abs_n, any_lane, fetch_ahead, fetch_to_write, comparisons, dot_n, lane access.
// Needs: nothing.  Reads: LANES (16, 8, 4 or 1), REAL_BITS (32 or 64).
//
// Out-of-line vector built-ins (select, any, fmin...) go through memory on PoCL; everything here compiles to plain vector instructions.
#pragma OPENCL FP_CONTRACT OFF
// Functions of the hot path: left to itself the compiler calls them, with vectors passed through memory.
#define HOT static inline __attribute__((always_inline))
#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)

#if REAL_BITS == 64
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
typedef double real;
typedef long lane_int;
#define R(x) x
#define REAL_NAME double
#define LANE_INT_NAME long
#define UNIT_ROUNDOFF 0x1p-53
#define TINY_COMPONENT 0x1p-500
#define UNDERFLOWN 0x1p-1060  // above the error of a few products below the range of `real`
#define HUGE_INVERSE 0x1p500
#define REAL_MAX DBL_MAX
#define WITHOUT_SIGN ((mask_n)0x7fffffffffffffffL)
#else
typedef float real;
typedef int lane_int;
#define R(x) x##f
#define REAL_NAME float
#define LANE_INT_NAME int
#define UNIT_ROUNDOFF 0x1p-24f
#define TINY_COMPONENT 0x1p-90f
#define UNDERFLOWN 0x1p-140f
#define HUGE_INVERSE 0x1p90f
#define REAL_MAX FLT_MAX
#define WITHOUT_SIGN ((mask_n)0x7fffffff)
#endif

#if LANES == 1
typedef real real_n;
typedef lane_int mask_n;
// A scalar comparison gives 1, a vector one -1 a lane; masks here are always 0 or -1.
#define is_less(a, b) ((mask_n) - ((a) < (b)))
#define is_at_most(a, b) ((mask_n) - ((a) <= (b)))
#define is_equal(a, b) ((mask_n) - ((a) == (b)))
#define to_real_n(x) ((real_n)(x))
typedef double double_n;
#define to_double_n(x) ((double)(x))
#define as_mask_n(x) PASTE(as_, LANE_INT_NAME)(x)
#define as_real_n(x) PASTE(as_, REAL_NAME)(x)
#else
typedef PASTE(REAL_NAME, LANES) real_n;
typedef PASTE(LANE_INT_NAME, LANES) mask_n;
#define is_less(a, b) ((a) < (b))
#define is_at_most(a, b) ((a) <= (b))
#define is_equal(a, b) ((a) == (b))
#define to_real_n(x) PASTE(PASTE(convert_, REAL_NAME), LANES)(x)
typedef PASTE(double, LANES) double_n;
#define to_double_n(x) PASTE(convert_double, LANES)(x)
#define as_mask_n(x) PASTE(PASTE(as_, LANE_INT_NAME), LANES)(x)
#define as_real_n(x) PASTE(PASTE(as_, REAL_NAME), LANES)(x)
#endif
#define is_greater(a, b) is_less(b, a)
#define is_at_least(a, b) is_at_most(b, a)

#define ALL_LANES ((mask_n)(-1))
#define NO_LANES ((mask_n)(0))
#define choose(m, a, b) ((m) ? (a) : (b))

HOT real_n min_n(real_n a, real_n b) { return choose(is_less(a, b), a, b); }
HOT real_n max_n(real_n a, real_n b) { return choose(is_greater(a, b), a, b); }
HOT real_n abs_n(real_n a) { return as_real_n(as_mask_n(a) & WITHOUT_SIGN); }

// Asks for what is read, or written, soon; nothing where the compiler has no word for it.
#if defined(__clang__) && (defined(__x86_64__) || defined(__aarch64__))
#define fetch_ahead(p) __builtin_prefetch((const void *)(uintptr_t)(p))
#define fetch_to_write(p) __builtin_prefetch((const void *)(uintptr_t)(p), 1)
#else
#define fetch_ahead(p)
#define fetch_to_write(p)
#endif

// One mask test where the instruction set has it, a halving reduction elsewhere.
#if LANES == 16 && REAL_BITS == 32 && defined(__AVX512DQ__) && defined(__clang__)
#define any_lane(m) (__builtin_ia32_cvtd2mask512(m) != 0)
#elif LANES == 8 && REAL_BITS == 64 && defined(__AVX512DQ__) && defined(__clang__)
#define any_lane(m) (__builtin_ia32_cvtq2mask512(m) != 0)
#elif LANES == 8 && REAL_BITS == 32 && defined(__AVX__) && defined(__clang__)
#define any_lane(m) (__builtin_ia32_movmskps256(as_float8(m)) != 0)
#elif LANES == 4 && REAL_BITS == 64 && defined(__AVX__) && defined(__clang__)
#define any_lane(m) (__builtin_ia32_movmskpd256(as_double4(m)) != 0)
#elif LANES == 4 && REAL_BITS == 32 && defined(__SSE__) && defined(__clang__)
#define any_lane(m) (__builtin_ia32_movmskps(as_float4(m)) != 0)
#elif LANES == 16
HOT int any_lane(mask_n m) {
    const PASTE(LANE_INT_NAME, 8) a = m.lo | m.hi;
    const PASTE(LANE_INT_NAME, 4) b = a.lo | a.hi;
    const PASTE(LANE_INT_NAME, 2) c = b.lo | b.hi;
    return (c.x | c.y) != 0;
}
#elif LANES == 8
HOT int any_lane(mask_n m) {
    const PASTE(LANE_INT_NAME, 4) b = m.lo | m.hi;
    const PASTE(LANE_INT_NAME, 2) c = b.lo | b.hi;
    return (c.x | c.y) != 0;
}
#elif LANES == 4
HOT int any_lane(mask_n m) {
    const PASTE(LANE_INT_NAME, 2) c = m.lo | m.hi;
    return (c.x | c.y) != 0;
}
#else
#define any_lane(m) ((m) != 0)
#endif

// Lanes through memory, for the rare scalar work on each.
#if LANES == 1
#define load_lanes(p) (*(p))
#define store_lanes(v, p) (*(p) = (v))
#else
#define load_lanes(p) PASTE(vload, LANES)(0, p)
#define store_lanes(v, p) PASTE(vstore, LANES)(v, 0, p)
#endif

// The number of lanes set.
HOT int count_lanes(mask_n m) {
    lane_int lane[LANES];
    store_lanes(m, lane);
    int n = 0;
    for (int k = 0; k < LANES; k++) n -= (int)lane[k];
    return n;
}

// The least number of all lanes, none of them NaN.
HOT real least_lane(real_n v) {
#if LANES == 1
    return v;
#else
#if LANES == 16
    const PASTE(REAL_NAME, 8) a = v.lo < v.hi ? v.lo : v.hi;
#elif LANES == 8
    const PASTE(REAL_NAME, 8) a = v;
#endif
#if LANES >= 8
    const PASTE(REAL_NAME, 4) b = a.lo < a.hi ? a.lo : a.hi;
#else
    const PASTE(REAL_NAME, 4) b = v;
#endif
    const PASTE(REAL_NAME, 2) c = b.lo < b.hi ? b.lo : b.hi;
    return c.x < c.y ? c.x : c.y;
#endif
}

// Dot products may contract: |error| <= 3u |a||b| fused, 5u |a||b| unfused (Higham 2002, section 3.1); bounds elsewhere assume the larger.
HOT real_n dot_n(const real_n *a, const real_n *b) {
#pragma OPENCL FP_CONTRACT ON
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
HOT real_n dot_uniform(const real_n *a, global const real *b) {
#pragma OPENCL FP_CONTRACT ON
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
// Of a point and a plane: the fourth number is its constant.
HOT real_n place_uniform(const real_n *a, global const real *b) {
#pragma OPENCL FP_CONTRACT ON
    return a[0] * b[0] + (a[1] * b[1] + (a[2] * b[2] + b[3]));
}
HOT real_n multiply_add(real_n a, real_n b, real_n c) {
#pragma OPENCL FP_CONTRACT ON
    return a * b + c;
}
