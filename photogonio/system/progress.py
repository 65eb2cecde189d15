"""What the user sees while the program works: lines, warnings, and a bar on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tqdm import tqdm

from photogonio.capture.diagnosis import Diagnosis

_LINE_EVERY = 5.0  # seconds between plain progress lines
_BAR_AFTER = 1.0  # seconds before a bar appears


class Reporter:
    """Speaks to the user. With ``json`` only the result goes to standard output."""

    def __init__(self, *, quiet: bool = False, json: bool = False):
        self.quiet = quiet
        self.diagnoses: list[Diagnosis] = []
        self.failed = False  # the command did its work, and what it found is a failure
        self.distrusted = False  # results were written, and a check says that they are not to be trusted
        self._out = sys.stderr if json else sys.stdout
        self._bar: tqdm | None = None
        self._label = ""
        self._started = self._spoken = 0.0

    def say(self, text: str) -> None:
        if not self.quiet:
            self.clear()
            print(text, file=self._out, flush=True)

    @property
    def warnings(self) -> list[str]:
        """What was told, in words."""
        return [one.message for one in self.diagnoses]

    def tell(self, *found: Diagnosis) -> None:
        """Warn of what was found, and keep it for the result."""
        self.diagnoses += found
        for one in found:
            self.warn(one.message)

    def warn(self, text: str) -> None:
        if not self.quiet:
            self.clear()
            print(f"warning: {text}", file=sys.stderr, flush=True)

    def distrust(self, lines: Sequence[str]) -> None:
        """``lines`` say why what was found is not to be trusted; none: it is. Who asked for quiet is told all the
        same, on standard error."""
        self.distrusted = self.distrusted or bool(lines)
        if self.quiet:
            for line in lines:
                print(f"photogonio: {line}", file=sys.stderr, flush=True)

    def progress(self, label: str, done: int, total: int) -> None:
        """``done`` of ``total`` steps of ``label`` are finished; may be called as often as one likes."""
        if self.quiet:
            return
        if label != self._label:
            self.clear()
            self._label, self._started, self._spoken = label, time.monotonic(), time.monotonic()
        if sys.stderr.isatty():
            self._draw(label, done, total)
        elif time.monotonic() - self._spoken >= _LINE_EVERY:
            self._spoken = time.monotonic()
            print(f"{label}: {done} of {total}", file=sys.stderr, flush=True)
        if done >= total:
            self.clear()

    def clear(self) -> None:
        """Take the bar off the screen."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        self._label = ""

    def _draw(self, label: str, done: int, total: int) -> None:
        if self._bar is None:
            if time.monotonic() - self._started < _BAR_AFTER:
                return
            from tqdm import tqdm

            self._bar = tqdm(total=total, desc=label, leave=False, file=sys.stderr, dynamic_ncols=True)
        self._bar.total = total
        self._bar.update(done - self._bar.n)


class Stopwatch:
    """Seconds between laps, by name; a name that comes again adds up."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name] = self.seconds.get(name, 0.0) + now - self._last
        self._last = now
