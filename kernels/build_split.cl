// Provides: Split, build_bin_scales, build_best_of_axis: the cheapest split of a node by the surface area heuristic.
// Needs: build_clip.cl (FP_CONTRACT OFF).  Reads: MOST_BINS, TRAVERSAL_COST, EMPTY_FACTOR.
//
// The same operations in the same order as clrt/kdtree/binning.py, so that both find the same split to the bit.
#define NUDGE 0x1p-20f
#define NARROWEST 0x1p-112
#define SMALLEST_NORMAL 0x1p-126f
#define WIDE 8

typedef struct {
    float cost, plane;
    int axis, flats_up;
} Split;

// Factors from a distance to a number of bins: [0] for where references begin, [1] for where they end, nudged off the planes.
static inline void build_bin_scales(float lo, float hi, int bins, float *scales) {
    const double extent = (double)hi - (double)lo;
    const float per_bin = extent > NARROWEST ? (float)((double)bins / extent) : 0.0f;
    scales[0] = per_bin * (1.0f + NUDGE);
    scales[1] = per_bin * (1.0f - NUDGE);
}

// Candidate planes: the first and the last are the bounds of the references.
static void build_planes(float lo, float hi, int bins, float *planes) {
    const double step = ((double)hi - (double)lo) / bins;
    for (int k = 0; k <= bins; k += WIDE) {
        const double8 position = (double)lo + step * (convert_double8(k + (int8)(0, 1, 2, 3, 4, 5, 6, 7)));
        const float8 rounded = convert_float8(position);
        // Split planes that would be subnormal become 0, since devices may flush them.
        vstore8(as_float8(as_int8(rounded) & ((rounded >= SMALLEST_NORMAL) | (rounded <= -SMALLEST_NORMAL))), 0, planes + k);
    }
    planes[0] = fabs(lo) < SMALLEST_NORMAL ? 0.0f : lo;
    planes[bins] = fabs(hi) < SMALLEST_NORMAL ? 0.0f : hi;
}

// Puts the cheapest plane of one axis into `best` where it beats what is there. lo, hi: bounds of the references along the axis.
// begins, ends: how many references do so in each bin, bin k in column k + 1: a running sum up to column k counts the bins below plane k.
static __attribute__((noinline)) void build_best_of_axis(const int *begins, const int *ends, int count, int bins, int axis, float lo,
                                                         float hi, const float *cell_lo, const float *cell_hi, Split *best) {
    double extent[3];
    for (int a = 0; a < 3; a++) extent[a] = (double)cell_hi[a] - (double)cell_lo[a];
    const double width = extent[axis], greatest = fmax(fmax(fmax(extent[0], extent[1]), extent[2]), DBL_MIN);
    const double along = width / greatest, one = extent[(axis + 1) % 3] / greatest, two = extent[(axis + 2) % 3] / greatest;
    const double total = along * (one + two) + one * two;
    // A child's area is the area of both ends and of the sides, the latter in proportion to its share of the cell.
    const double ends_area = one * two / total, sides_area = along * (one + two) / total;
    float planes[MOST_BINS + WIDE], lower[MOST_BINS + WIDE], upper[MOST_BINS + WIDE], costs[MOST_BINS + WIDE];
    build_planes(lo, hi, bins, planes);
    int low = 0, up = count;
    for (int k = 0; k < bins; k++) {
        lower[k] = (float)(low += begins[k]);
        upper[k] = (float)(up -= ends[k]);
    }
    for (int k = bins; k < bins + WIDE; k++) {  // to a whole number of vectors
        lower[k] = (float)count;
        upper[k] = 0.0f;
    }
    for (int k = 0; k <= bins; k += WIDE) {
        const double8 share = (convert_double8(vload8(0, planes + k)) - (double)cell_lo[axis]) / width;
        const float8 below = convert_float8(ends_area + sides_area * share), above = convert_float8(ends_area + sides_area * (1.0 - share));
        vstore8(TRAVERSAL_COST + below * vload8(0, lower + k) + above * vload8(0, upper + k), 0, costs + k);
    }
    costs[0] *= EMPTY_FACTOR;
    costs[bins] *= EMPTY_FACTOR;
    int chosen = -1;
    for (int k = 0; k <= bins; k++) {
        if (costs[k] < best->cost && planes[k] > cell_lo[axis] && planes[k] < cell_hi[axis]) {
            best->cost = costs[k];
            chosen = k;
        }
    }
    if (chosen < 0) return;
    const double share = ((double)planes[chosen] - (double)cell_lo[axis]) / width;
    const float below = (float)(ends_area + sides_area * share), above = (float)(ends_area + sides_area * (1.0 - share));
    best->plane = planes[chosen];
    best->axis = axis;
    // Flat triangles in the plane leave an empty child empty; else they go to the smaller child.
    best->flats_up = chosen == 0 || (chosen < bins && above < below);
}
