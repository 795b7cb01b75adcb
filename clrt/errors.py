"""What can go wrong, as types.

    ClrtError             whatever the user can mend; one clear message (command line: exit code 2)
    +-- SceneError        a scene text or a scene that cannot be rendered
    +-- MeshError         a file or an array of triangles that cannot be used
    +-- RayError          arrays of rays that cannot be used; also a ValueError
    +-- DeviceError       no OpenCL platform, no such device, a device that lacks what is asked for
    +-- LimitError        a size beyond what memory or the device's stack allows; said before it is taken

A message says what was found, where, and what to do instead.
"""

from __future__ import annotations


class ClrtError(Exception):
    """Anything the user can mend. The message is complete: the command line prints it as it is."""


class SceneError(ClrtError):
    """A scene that is refused. The message holds one ``file:line:column: error: ...`` line a fault."""


class MeshError(ClrtError):
    """Triangles that are refused: an unreadable file, no faces, indices out of range, NaN in the vertices."""


class RayError(ClrtError, ValueError):
    """Arrays of rays that are refused: a shape or a number type that does not fit. The message names the argument."""


class DeviceError(ClrtError):
    """No OpenCL device that fits. The message lists the devices there are, or how to install one."""


class LimitError(ClrtError):
    """Too large: a picture, a tree depth, a ray depth. Raised before memory is taken."""
