// Provides: what media have left of each colour before fog scatters into a ray.
// Needs: fog.cl, throughput.cl.  Reads: nothing.

//@hook fog_tint
            for (int a = 0; a < 3; a++) fog_weight[a] *= current.tint[a];
//@end
