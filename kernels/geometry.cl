// Provides: Geometry, what a ray can meet, by pointer.
// Needs: structs.  Reads: nothing.
//@ geometry_types
typedef struct {
    // Inner nodes: (bits of the split, lower child << 4 | 8 where the upper one is an empty leaf | 4 where the lower one is | axis);
    // leaves: (first index, count << 2 | 3).
    global const int2 *nodes;
    global const int *indices;           // triangle slots, leaf by leaf
    global const Triangle *triangles;    // a slot each, relative to the local origin, for rays of any origin
    global const EdgePlanes *planes;     // a slot each, seen from the shared origin
    global const double *vertices;       // 9 a slot: the numbers as given
    global const Surface *surfaces;      // a slot each
    global const Object *objects;
    int object_count, slot_count;        // objects; triangle slots of the scene
    double shared_origin[3];             // as given
    double local_origin[3];
    //@ geometry_members
} Geometry;
