// Provides: shares behind surfaces that let see through: light samples pass any number of them, rays that go straight on end with the depth. So what matte surfaces
//           get from lights falls to light samples alone; scattered rays bring the rest.
// Needs: mis.cl, indirect.cl.  Reads: nothing.
#define MIS_NEVER R(1e-30)  // a density beside which any other has the whole share, and no square of which is asked for

//@hook scattered_density
        if (HAVE_PANES) density = (real_n)0;
//@end
//@hook scattered_pushed
                if (HAVE_PANES) drawn->pdf = (real_n)MIS_NEVER;
//@end
