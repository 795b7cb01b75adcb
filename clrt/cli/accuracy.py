"""What is said of a picture's error: before, the forecast; after, the outcome beside it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from clrt.adaptive.predict import Forecast
    from clrt.stats import RunStats


def foretold(told: Forecast, error: float | None) -> str:
    """A line, before most of the work."""
    time, reached = told.seconds.to_json(), told.error.to_json()
    if error is not None:
        return f"foretold: an error below {percent(error)} takes {_seconds(time)} of rendering"
    return f"foretold: an error of {_percents(reached)}"


def outcome_lines(stats: RunStats) -> list[tuple[str, str]]:
    """Name and text of each line about accuracy; stats.accuracy is there."""
    accuracy: dict[str, Any] = stats.accuracy or {}
    found, samples = accuracy["error"], accuracy["samples"]
    if found is None:
        lines = [("error", "not known: there was time for the samples of one sequence alone, which do not tell")]
    else:
        asked = accuracy["asked_error"]
        verdict = "" if asked is None else f"; asked: {percent(asked)}" + ("" if accuracy["met"] else ", not reached")
        lines = [("error", f"{_percents(found)} of the picture's mean{verdict}")]
    told_time, told_error = accuracy["predicted_render_s"], accuracy["predicted_error"]
    if accuracy["asked_error"] is not None and told_time is not None:
        lines.append(("foretold", f"{_seconds(told_time)} of rendering; it took {stats.render_s:.3g} s"))
    elif accuracy["asked_within"] is not None and told_error is not None:
        lines.append(("foretold", f"an error of {_percents(told_error)}"))
    lines.append(("samples", f"{samples['least']:,} to {samples['most']:,} a pixel, {_mean(samples['mean'])} on average"))
    return lines


def _mean(samples: float) -> str:
    return f"{samples:,.0f}" if samples >= 1000.0 else f"{samples:.4g}"


def percent(value: float) -> str:
    return f"{100.0 * value:.3g}%"


def _percents(interval: dict[str, float | None]) -> str:
    value, low, high = interval["value"], interval["low"], interval["high"]
    ends = f"{percent(low or 0.0)} to {percent(high)}" if high is not None else f"{percent(low or 0.0)} or more"
    return f"{percent(value or 0.0)} ({ends}, with 95%)"


def _seconds(interval: dict[str, float | None]) -> str:
    value, low, high = interval["value"], interval["low"], interval["high"]
    return f"{value or 0.0:.3g} s ({low or 0.0:.3g} to {high or 0.0:.3g} s)"
