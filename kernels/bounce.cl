// Provides: Bounce: rays that go on from a hit, waiting on a stack; bounce_*.
// Needs: rays.cl, hit.cl, structs.  Reads: BOUNCE_STACK.
//
// Depth first: a packet comes off the stack and puts at most one on it for each of b branches, so depth * (b - 1) + 1 wait at most; one is to spare.
typedef struct {
    real_n origin[3], direction[3], weight;
    mask_n skip, active;
    int depth_left, from_eye;  // whether the ray's origin is the eye
    //@ bounce_members
} Bounce;

typedef struct {
    Bounce entry[BOUNCE_STACK];
    int count;
} BounceStack;

// Kinds of rays that go on from a hit, each at most once.
#define BRANCH_REFLECTED 1
#define BRANCH_REFRACTED 2
#define BRANCH_PASSED 3
#define BRANCH_SCATTERED 4
#define BRANCH_SHONE 5
#define BRANCH_MATTE 6

// Puts `direction` from the hit point on the stack for the lanes in `active`, starting on the side that it points to; gives its place there.
HOT Bounce *bounce_push(const Geometry *geometry, const Rays *rays, BounceStack *stack, const Hit *hit, const real_n *direction,
                        real_n weight, mask_n active, const Bounce *from, const uint branch) {
    Bounce *next = stack->entry + stack->count;
    if (!any_lane(active)) return next;
    stack->count++;
    *next = *from;
    real_n away[3] = {hit->geometric[0], hit->geometric[1], hit->geometric[2]};
    real_n start[3] = {hit->point[0], hit->point[1], hit->point[2]}, error = hit->error;
    //@ bounce_start
    face_towards(away, direction, 0);
    for (int a = 0; a < 3; a++) {
        next->origin[a] = choose(active, multiply_add(away[a], error, start[a]), (real_n)0);
        next->direction[a] = choose(active, direction[a], (real_n)1);
    }
    next->weight = weight;
    next->skip = load_lanes(hit->slot);
    next->active = active;
    next->depth_left = from->depth_left - 1;
    next->from_eye = 0;
    //@ bounce_pushed
    return next;
}

// Takes the next packet off the stack; 0 where none waits.
HOT int bounce_pop(BounceStack *stack, Bounce *current, real extent, Rays *rays) {
    if (stack->count == 0) return 0;
    *current = stack->entry[--stack->count];
    for (int a = 0; a < 3; a++) {
        rays->origin[a] = current->origin[a];
        rays->direction[a] = current->direction[a];
    }
    rays->t_min = (real_n)0;
    rays->t_max = (real_n)INFINITY;
    rays->skip = current->skip;
    rays->active = current->active;
    //@ bounce_popped
    rays_prepare(rays, extent);
    return 1;
}

// The reflected direction: about the shading normal, or about the true one where that would lead below the surface.
HOT void bounce_reflected(const Rays *rays, const Hit *hit, real_n *direction) {
    const real_n twice = R(2.0) * dot_n(rays->direction, hit->normal), true_twice = R(2.0) * dot_n(rays->direction, hit->geometric);
    for (int a = 0; a < 3; a++) direction[a] = rays->direction[a] - twice * hit->normal[a];
    const mask_n below = is_at_most(dot_n(direction, hit->geometric), (real_n)0);
    for (int a = 0; a < 3; a++) direction[a] = choose(below, rays->direction[a] - true_twice * hit->geometric[a], direction[a]);
    normalize_n(direction);
}

//@hook begin
    BounceStack bounces;
    Bounce current;
    bounces.count = 0;
    current.depth_left = frame->depth;
    current.from_eye = 1;
    //@ bounce_begin
//@end
//@hook trace
        // The eye's rays share their origin; those that go on do not.
        if (current.from_eye) {
            //@ eye_trace
        } else
            scene_trace(&geometry, &rays, SHARED_NOTHING, 0, &hits);
//@end
//@hook spawn
        if (current.depth_left > 0) {
            real_n reflected = (real_n)0;
            //@ bounce_weights
            real_n direction[3];
            bounce_reflected(&rays, &hit, direction);
            //@ reflected_drawn
            bounce_push(&geometry, &rays, &bounces, &hit, direction, weight * reflected, is_greater(weight * reflected, (real_n)0), &current,
                        BRANCH_REFLECTED);
            //@ reflected_pushed
        }
//@end
//@hook next
        if (!bounce_pop(&bounces, &current, frame->extent, &rays)) break;
        weight = current.weight;
//@end
//@hook light_origin
            from_eye = current.from_eye;
//@end
//@hook light_draws
            goes_on = current.depth_left > 0;
//@end
