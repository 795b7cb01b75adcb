// Provides: the functions of OpenCL that kernels use, in place of a compiler's header that declares 15,000.
// Needs: nothing.  In front of programs for PoCL alone, with the option -D_OPENCL_H_ (clrt/device/lean.py).
//
// Declared as in OpenCL 1.2, section 6.12; where one is missing, a program is compiled with the header.
#define OVERLOADED __attribute__((overloadable))
#define VALUE __attribute__((overloadable, const))
#define READING __attribute__((overloadable, pure))

size_t VALUE get_global_id(uint);
size_t VALUE get_global_size(uint);
size_t VALUE get_group_id(uint);
size_t VALUE get_local_id(uint);
size_t VALUE get_local_size(uint);
size_t VALUE get_num_groups(uint);

#define OF_ALL(D) D(float) D(float4) D(float8) D(float16) D(double) D(double4) D(double8) D(double16)
#define ONE(T, name) T VALUE name(T);
#define TWO(T, name) T VALUE name(T, T);
#define THREE(T, name) T VALUE name(T, T, T);
#define REALS(T)                                                                                                                           \
    ONE(T, ceil) ONE(T, cos) ONE(T, cospi) ONE(T, exp) ONE(T, fabs) ONE(T, floor) ONE(T, log) ONE(T, sign) ONE(T, sin) ONE(T, sinpi) ONE(T, sqrt)       \
    TWO(T, atan2) TWO(T, atan2pi) TWO(T, copysign) TWO(T, fmax) TWO(T, fmin) TWO(T, nextafter) TWO(T, pow) THREE(T, fma)
OF_ALL(REALS)

#define ORDERED(T) TWO(T, max) TWO(T, min) THREE(T, clamp)
OF_ALL(ORDERED)
ORDERED(int) ORDERED(uint) ORDERED(long) ORDERED(ulong)

#define BITS(T) ONE(T, clz) ONE(T, popcount)
BITS(int) BITS(uint) BITS(long) BITS(ulong)

#define CONVERT(T, N, from) T##N VALUE convert_##T##N(from##N);
#define CONVERSIONS(N) CONVERT(float, N, float) CONVERT(float, N, double) CONVERT(float, N, int) CONVERT(double, N, float)                  \
    CONVERT(double, N, double) CONVERT(double, N, int) CONVERT(int, N, float) CONVERT(int, N, double) CONVERT(int, N, long)                 \
    CONVERT(long, N, int) CONVERT(long, N, double) CONVERT(short, N, int)
CONVERSIONS(4) CONVERSIONS(8) CONVERSIONS(16)

#define ACCESS(T, N, space) T##N READING vload##N(size_t, const space T *); void OVERLOADED vstore##N(T##N, size_t, space T *);
#define SPACES(T, N) ACCESS(T, N, global) ACCESS(T, N, local) ACCESS(T, N, private) T##N READING vload##N(size_t, const constant T *);
#define WIDTHS(T) SPACES(T, 4) SPACES(T, 8) SPACES(T, 16)
WIDTHS(int) WIDTHS(uint) WIDTHS(long) WIDTHS(float) WIDTHS(double)

#define COUNTER(T, space) T OVERLOADED atomic_add(volatile space T *, T); T OVERLOADED atomic_inc(volatile space T *);
COUNTER(int, global) COUNTER(int, local) COUNTER(uint, global) COUNTER(uint, local)

// Nothing of the above but what OpenCL has by itself.
#undef VECTOR
#undef VECTORS
#undef OVERLOADED
#undef VALUE
#undef READING
#undef OF_ALL
#undef ONE
#undef TWO
#undef THREE
#undef REALS
#undef ORDERED
#undef BITS
#undef CONVERT
#undef CONVERSIONS
#undef ACCESS
#undef SPACES
#undef WIDTHS
#undef COUNTER
