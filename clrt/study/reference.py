"""The picture that others are judged by: float64 throughout, many samples of seeds of its own, and its own error.

Kept in the study's folder as reference.npz, so that a study that goes on does not render it again.
"""

from __future__ import annotations

import io
import json
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from clrt.errors import ClrtError
from clrt.features import Features
from clrt.files import atomic_write
from clrt.study.numbers import Number, number
from clrt.study.subject import REFERENCE_SEED, Subject

FloatArray = NDArray[np.float64]

RUNG = "double"
FILE = "reference.npz"
_SPLITS = 200  #: ways to part the batches into halves that are looked at
BIASED = "clamp"  #: an effect that moves the mean, and so has no place in the reference


@dataclass(frozen=True, eq=False)
class Reference:
    """batches : (k, h, w, 3) float64, means over independent seeds; samples : of a pixel in all of them together."""

    batches: FloatArray
    samples: int

    @property
    def mean(self) -> FloatArray:
        return np.asarray(self.batches.mean(axis=0))

    @property
    def squared_floor(self) -> float:
        """The mean square of the reference's own error, unbiased: the variance over its batches, over their number."""
        return float(self.batches.var(axis=0, ddof=1).mean()) / len(self.batches)

    def floor(self) -> Number:
        """The root mean square of its error, from split halves A and B: RMS(A - B) / 2 over many ways to split."""
        rng, count = np.random.default_rng(len(self.batches)), len(self.batches)
        flat = self.batches.reshape(count, -1)
        gram = flat @ flat.T / flat.shape[1]
        found = []
        for _ in range(_SPLITS):
            signs = np.where(rng.permutation(count) < count // 2, 1.0, -1.0) / (count // 2)
            found.append(float(np.sqrt(max(0.0, signs @ gram @ signs))) / 2.0)
        low, middle, high = np.percentile(found, (2.5, 50.0, 97.5))
        return number(float(middle), float(low), float(high), "radiance", count)


def reference_of(subject: Subject, samples: int, key: dict[str, Any]) -> Reference:
    """The reference of `samples` or more in all, from the folder where `key` says that it is this one, else rendered and kept there.

    Raises DeviceError, LimitError, OSError.
    """
    path, count = subject.folder / FILE, subject.plan.batches
    each = max(2, -(-samples // count))
    wanted = json.dumps({**key, "samples": each, "batches": count}, sort_keys=True)
    kept = _kept(path, wanted)
    if kept is not None:
        return Reference(kept, each * count)
    without = (BIASED,) if BIASED in Features.of(subject.scene).effects else ()
    shot = subject.shot(RUNG, samples=each, without=without)
    batches = []
    for batch in range(count):
        subject.tell("samples: the reference", batch / count)
        batches.append(shot.picture(each, REFERENCE_SEED + batch).astype(np.float64))
    stacked = np.stack(batches)
    if not np.isfinite(stacked).all():
        raise ClrtError("the reference has pixels that are not finite; a study of this scene means nothing")
    buffer = io.BytesIO()
    np.savez(buffer, batches=stacked, key=np.array(wanted))
    with atomic_write(path) as file:
        file.write(buffer.getvalue())
    return Reference(stacked, each * count)


def _kept(path: Path, wanted: str) -> FloatArray | None:
    """What an earlier run left, if it is of the same scene, size and plan."""
    try:
        with np.load(path, allow_pickle=False) as file:
            return np.asarray(file["batches"], np.float64) if str(file["key"]) == wanted else None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
