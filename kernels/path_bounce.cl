// Provides: numbers of the paths of rays that go on: each sends on as many as it likes, all with numbers of their own.
// Needs: path.cl, bounce.cl.  Reads: nothing.

//@hook bounce_members
    uint path;
//@end
//@hook bounce_begin
    current.path = 1;
//@end
//@hook bounce_pushed
    // Its kind sets what goes on from the same hit apart, whatever other lanes do. The factor is odd (2^32 over the golden ratio): no two numbers fall
    // together along a way.
    next->path = from->path * 0x9e3779b1u + branch;
//@end
//@hook next
        path = current.path;
//@end
