// Provides: counters of rays by kind and of ray-triangle tests by object, for the counting build alone.
// Needs: lanes.cl.  Reads: COUNT_* (the place of each kind), COUNT_TESTS (that of object 0).
//
// A counter is two words, the lower first: one launch can make more than 2^32 tests.
static inline void count_add(volatile global uint *counters, int place, uint n) {
    const uint before = atomic_add(counters + 2 * place, n);
    if (before > UINT_MAX - n) atomic_inc(counters + 2 * place + 1);
}

static inline void count_rays(volatile global uint *counters, int kind, mask_n lanes) {
    const int n = count_lanes(lanes);
    if (n > 0) count_add(counters, kind, (uint)n);
}

//@hook parameters
                   , volatile global uint *counters
//@end
//@hook arguments
                  , counters
//@end
//@hook geometry_members
    volatile global uint *counters;
//@end
//@hook hits_members
    int tests;
//@end
//@hook begin
    geometry.counters = counters;
//@end
//@hook hits_begin
    hits.tests = 0;
//@end
//@hook count_tests
            hits->tests += count_lanes(live) * (end - first);
//@end
//@hook count_met
        count_add(geometry->counters, COUNT_TESTS + geometry->surfaces[boxes->item[0]].object,
                  (uint)(count_lanes(group->active[p]) * popcount(met)));
//@end
//@hook count_object
        if (hits->tests > 0) count_add(geometry->counters, COUNT_TESTS + b, (uint)hits->tests);
        hits->tests = 0;
//@end
//@hook primary
    count_rays(counters, COUNT_PRIMARY, rays.active);
//@end
