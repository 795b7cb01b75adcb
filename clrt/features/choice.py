"""Effects by the names that people give: what `--without` leaves out."""

from __future__ import annotations

from collections.abc import Iterable

from clrt.errors import ClrtError
from clrt.features import FEATURES, HELPERS, Features

EFFECTS = tuple(f.name for f in FEATURES if f.name not in HELPERS)  #: names of all effects there are


def effect_names(given: Iterable[str]) -> tuple[str, ...]:
    """The effects that are meant, each once: case does not count, nor whether words are parted by spaces, `-` or `_`.

    Raises ClrtError with the nearest name there is.
    """
    return tuple(dict.fromkeys(_effect_name(name) for name in given))


def _effect_name(given: str) -> str:
    plain = " ".join(given.casefold().replace("-", " ").replace("_", " ").split())
    if plain in EFFECTS:
        return plain
    import difflib  # for faults alone

    near = difflib.get_close_matches(plain, EFFECTS, 1, 0.5)
    hint = f"did you mean '{near[0]}'?" if near else f"there are {', '.join(EFFECTS)}"
    raise ClrtError(f"no effect is called '{given}'; {hint}")


def not_called_for(names: Iterable[str], features: Features) -> tuple[str, ...]:
    """Those of `names` that are no effects of `features`."""
    return tuple(name for name in names if name not in features.effects)
