// Provides: the frame, and the switches in it, where a program of all effects asks for them without having it at hand.
// Needs: geometry.cl, structs.  Reads: nothing.

//@hook geometry_members
    global const Frame *frame;
//@end
//@hook begin
    geometry.frame = frame;
//@end
//@hook light_amount
        global const Frame *frame = geometry->frame;
//@end
//@hook scatter_share
    global const Frame *frame = geometry->frame;
//@end
//@hook mis_frame
    global const Frame *frame = geometry->frame;
//@end
