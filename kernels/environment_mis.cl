// Provides: the share of the environment's light that a drawn ray has found.
// Needs: environment_light.cl, mis.cl.  Reads: nothing.

//@hook environment_met
            const mask_n drawn_there = HAVE_ENVIRONMENT_LIGHT ? escaped & is_greater(current.pdf, (real_n)0) : NO_LANES;
            if (any_lane(drawn_there)) {
                // The samples of the environment bring the rest.
                real_n chance;
                gather(chance, environment_chance(frame, environment_rows, environment_columns, (int)cell[k]));
                const real_n share = choose(drawn_there, mis_drawn_share(&geometry, current.pdf, chance), (real_n)1);
                for (int a = 0; a < 3; a++) sky[a] *= share;
            }
//@end
