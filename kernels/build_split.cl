// Provides: Split, Bins, build_bin_scales, build_best: the cheapest split of a node by the surface area heuristic.
// Needs: build_clip.cl (FP_CONTRACT OFF).  Reads: MOST_BINS, TRAVERSAL_COST, EMPTY_FACTOR.
//
// The same operations in the same order as clrt/kdtree/binning.py, so that both find the same split to the bit.
#define NUDGE 0x1p-20f
#define NARROWEST 0x1p-112
#define SMALLEST_NORMAL 0x1p-126f

typedef struct {
    float cost, plane;
    int axis, flats_up;
} Split;

// Column k + 1 holds bin k, so that a running sum up to column k counts the bins below plane k.
typedef struct {
    int begins[3][MOST_BINS + 2], ends[3][MOST_BINS + 2];
} Bins;

// Split planes that would be subnormal become 0, since devices may flush them.
static inline float build_position(double position) {
    const float rounded = (float)position;
    return fabs(rounded) < SMALLEST_NORMAL ? 0.0f : rounded;
}

// Factors from a distance to a number of bins: [0] for where references begin, [1] for where they end, nudged off the planes.
static inline void build_bin_scales(float lo, float hi, int bins, float *scales) {
    const double extent = (double)hi - (double)lo;
    const float per_bin = extent > NARROWEST ? (float)((double)bins / extent) : 0.0f;
    scales[0] = per_bin * (1.0f + NUDGE);
    scales[1] = per_bin * (1.0f - NUDGE);
}

// Puts the cheapest plane of one axis into `best` where it beats what is there. lo, hi: bounds of the references along the axis.
static __attribute__((noinline)) void build_best_of_axis(const int *begins, const int *ends, int count, int bins, int axis, float lo, float hi,
                               const float *cell_lo, const float *cell_hi, Split *best) {
    double extent[3];
    for (int a = 0; a < 3; a++) extent[a] = (double)cell_hi[a] - (double)cell_lo[a];
    const double width = extent[axis], greatest = fmax(fmax(fmax(extent[0], extent[1]), extent[2]), DBL_MIN);
    const double along = width / greatest, one = extent[(axis + 1) % 3] / greatest, two = extent[(axis + 2) % 3] / greatest;
    const double total = along * (one + two) + one * two;
    // A child's area is the area of both ends and of the sides, the latter in proportion to its share of the cell.
    const double ends_area = one * two / total, sides_area = along * (one + two) / total;
    const double step = ((double)hi - (double)lo) / bins;
    int lower = 0, upper = count;
    for (int k = 0; k <= bins; k++) {
        lower += begins[k];
        upper -= ends[k];
        if (k == bins) {
            lower = count;
            upper = 0;
        }
        const float plane = build_position(k == 0 ? (double)lo : k == bins ? (double)hi : (double)lo + step * k);
        if (!(plane > cell_lo[axis] && plane < cell_hi[axis])) continue;
        const double share = ((double)plane - (double)cell_lo[axis]) / width;
        const float below = (float)(ends_area + sides_area * share), above = (float)(ends_area + sides_area * (1.0 - share));
        float cost = TRAVERSAL_COST + below * (float)lower + above * (float)upper;
        if (k == 0 || k == bins) cost *= EMPTY_FACTOR;
        if (cost < best->cost) {
            best->cost = cost;
            best->plane = plane;
            best->axis = axis;
            // Flat triangles in the plane leave an empty child empty; else they go to the smaller child.
            best->flats_up = k == 0 || (k < bins && above < below);
        }
    }
}
