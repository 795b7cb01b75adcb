// Provides: opaque_at: how much light primitives keep from passing straight through, where rays meet them.
// Needs: geometry.cl, structs.  Reads: nothing.

// `slot` holds a primitive a lane, -1 for none, which keeps nothing; `where` the points, three times LANES.
static __attribute__((noinline)) void opaque_at(const Geometry *geometry, const lane_int *slot, const real *where, real *kept) {
    for (int k = 0; k < LANES; k++) {
        kept[k] = R(0.0);
        if (slot[k] < 0) continue;
        int number = slot[k] < geometry->slot_count ? geometry->surfaces[slot[k]].material : 0;
        //@ opaque_round
        global const Material *material = geometry->materials + number;
        kept[k] = material->opacity;
        //@ opaque_picture
    }
}

//@hook geometry_members
    global const Material *materials;
//@end
//@hook begin
    geometry.materials = materials;
//@end
