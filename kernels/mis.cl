// Provides: mis_share: the power heuristic (Veach 1997, 9.2.4), and `pdf` of a ray: the density its direction was drawn with, per solid angle;
//           0 for rays that were not drawn: the eye's, those of mirrors and polished glass.
// Needs: bounce.cl.  Reads: nothing.

// The share of the one who drew with density `mine`, where another could have drawn the same with `other`: 1 where that could not.
// By the quotient, not by squares of densities, which overflow.
HOT real_n mis_share(const Geometry *geometry, real_n mine, real_n other) {
    const real_n ratio = other / mine;
    real_n share = choose(is_greater(other, (real_n)0), R(1.0) / (R(1.0) + ratio * ratio), (real_n)1);
    //@ mis_of_lights
    return share;
}

// The share of a ray that was drawn with density `mine` and met a light that samples of lights draw with `other`.
HOT real_n mis_drawn_share(const Geometry *geometry, real_n mine, real_n other) {
    real_n share = mis_share(geometry, mine, other);
    //@ mis_of_drawn
    return share;
}

//@hook bounce_members
    real_n pdf;
    real_n before;  // the way that the ray has gone since it was drawn, before its origin
//@end
//@hook bounce_begin
    current.pdf = (real_n)0;
    current.before = (real_n)0;
//@end
//@hook bounce_pushed
    next->pdf = (real_n)0;
    next->before = (real_n)0;
//@end
//@hook drawn_pushed
            drawn->pdf = chance;
//@end
//@hook passed_pushed
            // A ray that goes straight on is still the one that was drawn.
            passed->pdf = current.pdf;
            passed->before = current.before + way;
//@end
