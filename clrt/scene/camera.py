"""The camera of a scene text: from the lines E, V, F, R, or from E, R and the O line with the image's corners."""

from __future__ import annotations

import numpy as np

from clrt.scene.faults import Faults
from clrt.scene.grammar import LETTERS, MOST_PIXELS
from clrt.scene.model import Camera, FloatArray
from clrt.scene.text import Declarations
from clrt.scene.triangles import flip_x, scaled, unit

_UP = (0.0, 1.0, 0.0)

#: letter -> what it gives, and a line that would do
_NEEDED = {
    "E": ("eye", "E 0 0 -1"),
    "V": ("view direction", "V 0 0 1"),
    "F": ("field of view", "F 45"),
    "R": ("resolution", "R 512 512"),
}

#: The volume that the unit vectors to three corners span is about the solid angle of the picture: 1e-9 at 0.002 degrees.
#: It is off by 1e-15 at most, so this tells an eye in the image's plane, or a picture without extent, from a narrow view.
_LEAST_VOLUME = 1e-12

#: of the angle between view and up; a little more than what `Camera.from_view` refuses
_LEAST_SINE = 2e-12

Line = tuple[int, FloatArray]  #: line number, numbers


def build_camera(found: Declarations, right_handed: bool, faults: Faults) -> Camera | None:
    """The camera, or None with faults noted: lines missing, repeated or in conflict, or a view without extent.

    right_handed : turn x round in the lines; the picture's right then follows from the turned view, which is why
        mirroring the finished camera would not do
    """
    corners = found.get("O", 12)
    for letter in "EVFR":
        _check_once(found.lines_of(letter).tolist(), letter, found, faults)
    _check_once(corners.lines.tolist(), "O with image corners", found, faults)
    for letter in "VF" if len(corners) else "":
        for line in found.lines_of(letter).tolist():
            place = found.token(line, 0).column
            faults.add(line, place, f"{letter} has no effect beside the image corners of line {corners.lines[0]}; remove one of the two")
    # An unreadable O line may have been the image's corners: nothing is missing for certain.
    needed = "ER" if len(corners) or "O" in found.broken else "EVFR"
    missing = [letter for letter in needed if not _check_present(letter, found, faults)]

    used = {letter: _single(letter, found, faults) for letter in "EVFRO"}
    size_fits, view_has_sides = _check_pixels(used["R"], found, faults), _check_view(used["V"], found, faults)
    eye, view, fov, size, plane = (used[letter] for letter in "EVFRO")
    if missing or not size_fits or not view_has_sides or not eye or not size:
        return None
    width, height = size[1].astype(int).tolist()
    turn = flip_x if right_handed else np.array
    if plane:
        rays = _checked_corners(plane, eye, found, faults)
        return None if rays is None else Camera(turn(eye[1]), turn(rays), width, height)
    if not view or not fov:
        return None
    forward, up = _view_and_up(view[1])
    return Camera.from_view(turn(eye[1]), turn(forward), turn(up), float(fov[1][0]), width, height)


def _check_once(lines: list[int], what: str, found: Declarations, faults: Faults) -> None:
    for line in lines[1:]:
        faults.add(line, found.token(line, 0).column, f"a second {what} line; the first is line {lines[0]}, remove one of the two")


def _check_present(letter: str, found: Declarations, faults: Faults) -> bool:
    """Whether there is such a line; notes the fault otherwise."""
    if len(found.lines_of(letter)):
        return True
    what, example = _NEEDED[letter]
    faults.add(1, 1, f'there is no {what} ({letter}); add a line such as "{example}"')
    return False


def _single(letter: str, found: Declarations, faults: Faults) -> Line | None:
    """The first line of a letter (of O: with 12 numbers) that is free of faults."""
    forms = [found.get(letter, fields) for fields in LETTERS[letter] if fields]
    lines = [(line, values) for rows in forms for line, values in zip(rows.lines.tolist(), rows.values, strict=True)]
    return next(((line, values) for line, values in lines if not faults.on_line(line)), None)


def _check_pixels(size: Line | None, found: Declarations, faults: Faults) -> bool:
    """Refuse a picture too large for memory before anything is allocated."""
    if size is None:
        return True
    line, (width, height) = size
    if width * height <= MOST_PIXELS:
        return True
    message = f"a picture has at most {MOST_PIXELS} pixels, found {width:.0f} x {height:.0f}; make it smaller"
    faults.add(line, found.token(line, 1).column, message)
    return False


def _view_and_up(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The two vectors of a V line times powers of two: no digit changes, and no square over- or underflows."""
    return scaled(values[:3]), scaled(values[3:] if len(values) == 6 else np.array(_UP))


def _check_view(given: Line | None, found: Declarations, faults: Faults) -> bool:
    """Refuse a view direction that leaves no right and left."""
    if given is None:
        return True
    line, values = given
    view, up = _view_and_up(values)
    index = 1
    if not view.any():
        message = 'the view direction is zero; expected a direction, such as "V 0 0 1"'
    elif not up.any():
        index, message = 4, 'the up vector is zero; expected a direction, such as "0 1 0"'
    elif np.linalg.norm(np.cross(unit(up), unit(view))) > _LEAST_SINE:
        return True
    elif len(values) == 6:
        index, message = 4, "the up vector is parallel to the view direction; expected one towards the picture's top"
    else:
        message = f'the view direction is parallel to the up vector 0 1 0; add another, as in "V 0 {values[1]:g} 0 0 0 1"'
    faults.add(line, found.token(line, index).column, message)
    return False


def _checked_corners(plane: Line, eye: Line, found: Declarations, faults: Faults) -> FloatArray | None:
    """Vectors (4, 3) from the eye to the image corners, given as points of the scene: UL UR LL LR."""
    line, values = plane
    corners = values.reshape(4, 3) - eye[1]
    ul, ur, ll, lr = unit(corners)
    upper, lower = float(np.linalg.det([ul, ur, ll])), float(np.linalg.det([lr, ll, ur]))
    message = ""
    if min(abs(upper), abs(lower)) < _LEAST_VOLUME:
        message = "the eye lies in the plane of the image corners, or three of them in a line; expected corners in front of the eye"
    elif upper * lower < 0.0:
        message = "the image corners cross; expected their order to be upper left, upper right, lower left, lower right"
    if message:
        faults.add(line, found.token(line, 1).column, message)
        return None
    return corners
