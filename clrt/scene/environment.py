"""The word `environment`: light from all around, as a picture by longitude and latitude."""

from __future__ import annotations

import math

from clrt.scene.faults import Faults
from clrt.scene.model import Environment
from clrt.scene.picture import Folders, PictureError
from clrt.scene.radiance import read_radiance
from clrt.scene.text import Declarations


def read_environment(found: Declarations, folders: Folders, faults: Faults) -> Environment | None:
    """The environment of the first line with the word, None without one; what is wrong with it is noted."""
    calls = {call.name: call for call in reversed(found.words) if call.name in ("environment", "background")}
    call = calls.get("environment")
    if call is None:
        return None
    if "background" in calls:
        other = f"the background of line {calls['background'].line}"
        faults.add(call.line, call.column, f"environment beside {other}: both are what is seen behind all; remove one of the two")
    name = call.text("picture")
    try:
        radiance = read_radiance(folders.find(name), name)
    except (PictureError, OSError) as problem:
        faults.add(call.line, call.columns["picture"], str(problem))
        return None
    rotation = math.radians(call.number("rotate"))
    return Environment(radiance * call.number("intensity"), rotation, name, call.line)
