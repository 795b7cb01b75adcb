// Provides: Directions, Spread, least_directions, directions_in_steps, boxes_met, boxes_near, first_bit; prepare_directions, prepare_unions: which triangles of a leaf rays
//           of a shared origin can meet at all.
// Needs: lanes.cl, rays.cl, triangle.cl, structs.  Reads: BOXES (16).
//
// A ray that starts at o meets a triangle only if its direction, at unit length, lies in the triangle's projection onto the unit sphere
// about o. A box around that projection and one around the directions of many rays are compared for 16 triangles at once: six comparisons in
// place of 16 tests of each packet.
//   Let v be the unit vectors to the corners and L their greatest distance. A point x of their hull, with weights w, has
//   |x|^2 = 1 - sum w |v - x|^2, and that sum is at most the same about the centre of the smallest circle around the corners, whose radius is at
//   most L / sqrt(3) (Jung 1901). So x / |x|, which is in the projection, lies within 1 - sqrt(1 - L^2 / 3) of x, and the box of the corners holds
//   the projection once it is wider by that.
//   Boxes are kept as whole numbers of steps, rounded outwards, from the middle of the scene as seen from o: `boxes_scale` below. Directions
//   are off unit length by at most 5u < 2^-21, and rounded twice more on their way to steps: boxes are wider by WIDENING, twice as much,
//   and by a step: what the true ray meets is never left out, on any rung.
#define WIDENING 0x1p-20

// Bounds of directions: of component a, all are between lo[a] and hi[a], in steps.
typedef struct {
    short lo[4], hi[4];
} __attribute__((aligned(16))) Directions;

// Bounds of the directions of a packet, or of what stands for them: the least of each component, and of its negative; +INFINITY of no lanes.
typedef struct {
    real lo[4], minus_hi[4];
} Spread;

typedef PASTE(REAL_NAME, 4) real_4;
typedef PASTE(REAL_NAME, 8) real_8;

HOT void least_directions(const Rays *rays, Spread *of) {
    of->lo[3] = of->minus_hi[3] = 0;
    #pragma unroll
    for (int a = 0; a < 3; a++) {
        of->lo[a] = least_lane(choose(rays->active, rays->direction[a], (real_n)INFINITY));
        of->minus_hi[a] = least_lane(choose(rays->active, -rays->direction[a], (real_n)INFINITY));
    }
}

// How directions from an origin are measured: the middle, and steps a unit. The first block of an origin holds these in place of boxes.
typedef struct {
    float middle[3], steps;
} DirectionScale;

HOT int direction_step(real direction, real middle, real steps) {
    const real step = (direction - middle) * steps;
    return step < (real)-32700 ? -32700 : step > (real)32700 ? 32700 : (int)step;
}

// In steps, one wider on both sides, and one more for what the conversion cuts off; of no lanes at all: bounds that meet no box.
HOT void directions_in_steps(global const DirectionBoxes *boxes, const Spread *of, Directions *all) {
    global const DirectionScale *scale = (global const DirectionScale *)boxes;
    const real_8 bound = (real_8)(vload4(0, of->lo), -vload4(0, of->minus_hi));
    const real_4 middle = (real_4)(scale->middle[0], scale->middle[1], scale->middle[2], 0);
    real_8 step = (bound - (real_8)(middle, middle)) * (real_8)scale->steps;
    step = step < (real_8)-32700 ? (real_8)-32700 : step;
    step = step > (real_8)32700 ? (real_8)32700 : step;
    const int8 wide = convert_int8(step) + (int8)(-2, -2, -2, -2, 2, 2, 2, 2);
    const int8 none = (int8)(SHRT_MAX, SHRT_MAX, SHRT_MAX, SHRT_MAX, SHRT_MIN, SHRT_MIN, SHRT_MIN, SHRT_MIN);
    *(short8 *)all->lo = convert_short8((int8)(-(of->lo[0] < (real)INFINITY)) ? wide : none);
}

#if defined(__AVX512BW__) && defined(__AVX512VL__) && defined(__AVX512DQ__) && defined(__clang__)
#define box_bits(m) ((uint)__builtin_ia32_cvtw2mask256(m))
#define near_bits(m) ((uint)__builtin_ia32_cvtd2mask512(m))
#else
#if defined(__SSE2__) && defined(__clang__)
#define box_bits(m) ((uint)__builtin_ia32_pmovmskb128(__builtin_ia32_packsswb128((m).lo, (m).hi)))
#else
HOT uint box_bits(short16 m) {
    const ushort16 bits = as_ushort16(m) & (ushort16)(1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096, 8192, 16384, 32768);
    const ushort8 a = bits.lo | bits.hi;
    const ushort4 b = a.lo | a.hi;
    const ushort2 c = b.lo | b.hi;
    return (uint)(c.x | c.y);
}
#endif
#define near_bits(m) box_bits(convert_short16(m))
#endif
#ifdef __clang__
#define first_bit(bits) __builtin_ctz(bits)
#else
#define first_bit(bits) (31 - (int)clz((bits) & -(bits)))
#endif

#define PREPARE_DIRECTIONS 2
#define PREPARE_UNIONS 3

// A bit for each of 16 triangles or records whose box meets that of the directions.
HOT uint boxes_met(global const DirectionBoxes *boxes, const Directions *all) {
    global const short16 *lo = (global const short16 *)boxes->lo, *hi = (global const short16 *)boxes->hi;
    return box_bits((lo[0] <= all->hi[0]) & (hi[0] >= all->lo[0]) & (lo[1] <= all->hi[1]) & (hi[1] >= all->lo[1])
                    & (lo[2] <= all->hi[2]) & (hi[2] >= all->lo[2]));
}

// A bit for each that is not all farther away than `far`.
HOT uint boxes_near(global const DirectionBoxes *boxes, float far) { return near_bits(*(global const float16 *)boxes->near <= far); }

// Of numbers, none of them NaN: each is one instruction, which fmax, fmin and floor are not.
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

// The greatest whole number not above `value`, within the range of int.
static inline int whole_below(double value) {
    const int cut = (int)value;
    return cut - (value < cut);
}

// The boxes of one triangle of a block, from the numbers as given, in float64. Where there is none, the box is one that nothing
// meets; of a triangle that is large, or on whose corner the origin lies, one that all meet. `near` is no farther than the triangle: the
// distance to its box along the axes, rounded down.
static __attribute__((noinline)) void prepare_directions(global const double *vertices, global const int2 *blocks, int item, const double *origin,
                                                         float4 scale, global DirectionBoxes *records) {
    const int block = item / BOXES, k = item % BOXES;
    if (item == 0) {
        global DirectionScale *head = (global DirectionScale *)records;
        head->middle[0] = scale.x;
        head->middle[1] = scale.y;
        head->middle[2] = scale.z;
        head->steps = scale.w;
    }
    const float middle[3] = {scale.x, scale.y, scale.z};
    global DirectionBoxes *box = records + 1 + block;
    const int slot = k < blocks[block].y ? blocks[block].x + k : -1;
    double unit[3][3], square = 0, gap[3];
    int known = slot >= 0;
    for (int c = 0; c < 3 && slot >= 0; c++) {
        double size = 0;
        for (int a = 0; a < 3; a++) {
            unit[c][a] = vertices[9 * (size_t)slot + 3 * c + a] - origin[a];
            size = larger(size, fabs(unit[c][a]));
        }
        known &= size > 0 && size < INFINITY;
    }
    for (int a = 0; a < 3; a++) {
        const double lo = smaller(smaller(unit[0][a], unit[1][a]), unit[2][a]), hi = larger(larger(unit[0][a], unit[1][a]), unit[2][a]);
        gap[a] = larger(larger(lo, -hi), 0.0);
    }
    const double size = larger(larger(gap[0], gap[1]), gap[2]);
    double near = 0;
    if (known && size > 0) {  // scaled, as squares could under- or overflow
        for (int a = 0; a < 3; a++) gap[a] /= size;
        near = size * sqrt(dot_double(gap, gap)) * (1 - WIDENING);
    }
    box->near[k] = slot < 0 ? INFINITY : (float)smaller(near, (double)FLT_MAX) * (1 - 0x1p-22f);
    for (int c = 0; c < 3 && known; c++) {
        double largest = 0;
        for (int a = 0; a < 3; a++) largest = larger(largest, fabs(unit[c][a]));
        for (int a = 0; a < 3; a++) unit[c][a] /= largest;
        const double length = sqrt(dot_double(unit[c], unit[c]));
        for (int a = 0; a < 3; a++) unit[c][a] /= length;
    }
    for (int c = 0; c < 3 && known; c++) {
        double apart[3];
        for (int a = 0; a < 3; a++) apart[a] = unit[c][a] - unit[(c + 1) % 3][a];
        square = larger(square, dot_double(apart, apart));
    }
    known &= square < 1;
    const double wider = 1 - sqrt(1 - smaller(square, 1.0) / 3) + WIDENING;
    for (int a = 0; a < 3; a++) {
        // Clamped, both ends stay where what they are compared with is clamped to, or beyond.
        double lo = SHRT_MIN, hi = SHRT_MAX;
        if (known) {
            lo = larger(lo, (smaller(smaller(unit[0][a], unit[1][a]), unit[2][a]) - wider - middle[a]) * scale.w);
            hi = smaller(hi, (larger(larger(unit[0][a], unit[1][a]), unit[2][a]) + wider - middle[a]) * scale.w);
        }
        box->lo[a][k] = slot < 0 ? SHRT_MAX : (short)whole_below(smaller(lo, 32000.0));
        box->hi[a][k] = slot < 0 ? SHRT_MIN : (short)-whole_below(-larger(hi, -32000.0));
    }
    box->item[k] = slot;
}

// The boxes of one record, as an entry of the record above it: `count` records from `below` on, 16 to each behind them.
static __attribute__((noinline)) void prepare_unions(global DirectionBoxes *records, int entry, int below, int count) {
    const int k = entry % BOXES;
    global DirectionBoxes *box = records + below + count + entry / BOXES;
    const int there = entry < count;
    global const DirectionBoxes *of = records + below + (there ? entry : 0);
    for (int a = 0; a < 3; a++) {
        short lo = SHRT_MAX, hi = SHRT_MIN;
        for (int i = 0; i < BOXES && there; i++) {
            lo = of->lo[a][i] < lo ? of->lo[a][i] : lo;
            hi = of->hi[a][i] > hi ? of->hi[a][i] : hi;
        }
        box->lo[a][k] = lo;
        box->hi[a][k] = hi;
    }
    float near = INFINITY;
    for (int i = 0; i < BOXES && there; i++) near = of->near[i] < near ? of->near[i] : near;
    box->near[k] = near;
    box->item[k] = there ? below + entry : -1;
}

//@hook geometry_members
    global const DirectionBoxes *boxes;  // as seen from the shared origin: how directions are measured, blocks of triangles, records of records
    int block_count, box_count;          // blocks; all records, the last of which is the root, with the first. 0: none are at hand
//@end
//@hook parameters
                   , global const DirectionBoxes *eye_boxes, const int block_count, const int box_count
//@end
//@hook arguments
                  , eye_boxes, block_count, box_count
//@end
//@hook begin
    geometry.boxes = eye_boxes;
    geometry.block_count = block_count;
    geometry.box_count = box_count;
//@end
//@hook prepare_parameters
                    , global const int2 *blocks, float4 scale, global DirectionBoxes *records, int below, int below_count
//@end
//@hook prepare
    if (what == PREPARE_DIRECTIONS) prepare_directions(vertices, blocks, item, origin, scale, records + first);
    if (what == PREPARE_UNIONS) prepare_unions(records + first, item, below, below_count);
//@end
