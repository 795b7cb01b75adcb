"""How long launches take: a part whatever they trace, and a factor over the work that was expected of their tiles."""

from __future__ import annotations


class Pace:
    """A line through what launches took, by least squares over all so far: long ones weigh most, as they do in what is to come."""

    def __init__(self, least: float) -> None:
        """least : seconds of a launch that traces nothing; the fixed part is not below."""
        self.least = least
        self.count, self.work, self.seconds, self.squares, self.products = 0, 0.0, 0.0, 0.0, 0.0

    def learn(self, work: float, seconds: float) -> None:
        """A launch that was expected to take `work` seconds, with all that goes with it, took these."""
        self.count += 1
        self.work += work
        self.seconds += seconds
        self.squares += work * work
        self.products += work * seconds

    def line(self) -> tuple[float, float]:
        """Fixed seconds, and the factor over the work; (least, 1) where nothing was learnt."""
        if self.count == 0 or self.work <= 0.0:
            return self.least, 1.0
        spread = self.count * self.squares - self.work**2
        fixed = self.least
        if self.count > 2 and spread > 1e-6 * self.work**2:
            factor = (self.count * self.products - self.work * self.seconds) / spread
            fixed = min(max((self.seconds - factor * self.work) / self.count, self.least), self.seconds / self.count)
        return fixed, max((self.seconds - self.count * fixed) / self.work, 0.1)
