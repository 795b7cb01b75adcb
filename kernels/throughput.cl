// Provides: a weight for each colour: `tint` of a ray is what is left of red, green and blue on the way to its origin, besides `weight`.
// Needs: bounce.cl.  Reads: nothing.

//@hook bounce_members
    real_n tint[3];
//@end
//@hook bounce_begin
    for (int a = 0; a < 3; a++) current.tint[a] = (real_n)1;
//@end
//@hook arrived
        real_n faded[3];
        for (int a = 0; a < 3; a++) faded[a] = weight * current.tint[a];
        weight = choose(is_greater(max_n(max_n(faded[0], faded[1]), faded[2]), (real_n)0), weight, (real_n)0);
//@end
//@hook channel
            const real_n weight = faded[a];  // that of this colour, in place of the one they share
//@end
