// Provides: Shade.added: light that leaves a hit without the surface's colour: what it sends out by itself, what its gloss shows.
// Needs: hit.cl.  Reads: nothing.

//@hook shade_members
    real_n added[3];
//@end
//@hook shade_begin
        for (int a = 0; a < 3; a++) shade.added[a] = (real_n)0;
//@end
//@hook channel
            seen += shade.added[a];
//@end
