"""What a caller asks of a picture's accuracy, checked, and how it is carried out, by modules that are imported where it is asked."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from clrt.errors import ClrtError, LimitError
from clrt.features import Features
from clrt.features.camera import SAMPLES
from clrt.stats import RunStats

if TYPE_CHECKING:
    from clrt.adaptive.engine import Goal, Outcome
    from clrt.adaptive.predict import Forecast
    from clrt.adaptive.replicates import Replicates
    from clrt.device.session import Tracer

ERRORS = (1e-6, 1.0)  #: that may be asked for
LONGEST_S = 1e6  #: that may be asked for
_CONTRAST = 1.0 / 256.0  #: a step of an 8-bit picture: what is refined where a time is given and no error

Foretell = Callable[["Forecast"], None]


@dataclass(frozen=True)
class Request:
    """error, within : as asked for, None where not; pixels : the error of each pixel is asked for.

    deadline : time.perf_counter() at which `within` ends
    """

    error: float | None = None
    within: float | None = None
    pixels: bool = False
    deadline: float | None = None

    @classmethod
    def of(cls, error: float | None, within: float | None, samples: int | None, standard_error: bool, deadline: float | None) -> Request:
        """Raises LimitError for numbers out of range, ClrtError for what contradicts itself."""
        if error is not None and not ERRORS[0] <= error < ERRORS[1]:
            raise LimitError(f"an error of {error:g} is out of range; it is relative, from {ERRORS[0]:g} to below 1, such as 0.01")
        if within is not None and not 0.0 < within <= LONGEST_S:
            raise LimitError(f"a time of {within:g} s is out of range; it is above 0 s, and {LONGEST_S:g} s at most")
        adaptive = error is not None or within is not None
        if adaptive and samples is not None:
            raise ClrtError("samples are chosen by error and within; give either these, or a number of samples")
        if deadline is None and within is not None:
            deadline = time.perf_counter() + within
        return cls(error, within, standard_error, deadline)

    def __bool__(self) -> bool:
        return self.error is not None or self.within is not None or self.pixels

    @property
    def split(self) -> bool:
        """Samples as given, in replicates, so that their error is known."""
        return self.pixels and self.error is None and self.within is None

    @property
    def replicates(self) -> int:
        """How many the picture is made of."""
        from clrt.adaptive.replicates import HALVES, MAP_REPLICATES

        return MAP_REPLICATES if self.pixels else HALVES

    def samples(self, given: int | None) -> int | None:
        """For the scene: more than one where accuracy is asked for, so that places in the pixel are drawn."""
        return 2 if self and not self.split else given

    def goal(self, samples: int) -> Goal:
        """Raises ClrtError where `samples`, those of the scene, cannot be split."""
        from clrt.adaptive.engine import Goal

        if not self.split:
            return Goal(self.error, self.deadline)
        count = self.replicates
        if samples % count:
            near = max(1, round(samples / count)) * count
            raise ClrtError(
                f"a standard error needs samples that can be split over {count} sequences; {samples} cannot; "
                f"take {near} samples, or error or within"
            )
        return Goal(samples=samples)

    def contrast(self, features: Features) -> float | None:
        """Where edges alone are refined: nothing but the place in the pixel is drawn."""
        if self.split or any(f.sampled and f is not SAMPLES for f in features.active):
            return None
        return self.error if self.error is not None else _CONTRAST


def check_sampled(features: Features) -> None:
    """Raises ClrtError where the program draws nothing, so that nothing can be said of an error."""
    if not any(f.name == "sampling" for f in features.active):
        raise ClrtError(
            "nothing is sampled without the effect 'samples', so there is no error to ask for; "
            "give more than one sample, or leave out error, within and the standard error"
        )


def sample(
    tracer: Tracer, request: Request, tell: Callable[[float], None], foretell: Foretell | None
) -> tuple[Outcome | None, Replicates | None]:
    """Carries out a request, where one was made. Raises LimitError, ClrtError."""
    if not request:
        return None, None
    from clrt.adaptive.engine import Engine
    from clrt.adaptive.replicates import Replicates

    buffers = tracer.buffers
    goal = request.goal(buffers.packed.scene.samples)
    replicates = Replicates(tracer, request.replicates)
    engine = Engine(replicates, goal, tell, foretell or (lambda told: None), request.contrast(buffers.features))
    return engine.run(), replicates


def note(stats: RunStats, request: Request, outcome: Outcome) -> None:
    """The figures of the outcome."""
    least, mean, most = outcome.samples
    stats.samples, stats.samples_per_pixel = most, mean
    told = outcome.forecast
    accuracy: dict[str, Any] = {
        "asked_error": request.error, "asked_within": request.within, "met": outcome.met, "error": outcome.error.to_json(),
        "predicted_render_s": told.seconds.to_json() if told is not None else None,
        "predicted_error": told.error.to_json() if told is not None else None,
        "samples": {"least": least, "mean": mean, "most": most},
    }  # fmt: skip
    if math.isinf(outcome.error.value):
        accuracy["error"] = None
    stats.accuracy = accuracy
