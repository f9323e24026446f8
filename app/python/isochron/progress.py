"""How far long calls have come: a bar in notebooks and on terminals, lines elsewhere, or a callable of the user's."""

from __future__ import annotations

import contextlib
import html
import math
import sys
import time
from collections.abc import Callable, Iterator
from typing import Any, TextIO

Progress = bool | Callable[[float, float, float], Any] | None
"""None: shown in notebooks and on terminals. True: everywhere. False: not. A callable: progress(done, total, loss), of runs the iterations
done, those in all and the loss; of other calls the part that is done, 1 and NaN."""

FIRST = 0.5
"""Seconds before anything is shown: short calls show nothing."""
BETWEEN_LINES = 5.0
"""Seconds, where a line cannot be drawn over."""
WIDTH = 24


def in_notebook() -> bool:
    """Whether an IPython kernel runs this. IPython is not loaded for it."""
    module = sys.modules.get("IPython")
    shell = module.get_ipython() if module and hasattr(module, "get_ipython") else None
    return getattr(shell, "kernel", None) is not None


class _Lines:
    """On a stream: drawn over in place on a terminal, else a line every few seconds."""

    def __init__(self, stream: TextIO) -> None:
        self._stream, self._terminal, self._last = stream, stream.isatty(), -math.inf

    def show(self, fraction: float, text: str) -> None:
        if self._terminal:
            filled = round(WIDTH * fraction)
            self._write(f"\r\x1b[K[{'#' * filled}{'.' * (WIDTH - filled)}] {text}\r")
        elif time.monotonic() - self._last >= BETWEEN_LINES:
            self._last = time.monotonic()
            self._write(text + "\n")

    def clear(self) -> None:
        if self._terminal:
            self._write("\r\x1b[K")

    def end(self, text: str) -> None:
        if self._terminal:
            self._write("\r\x1b[K" + (text and text + "\n"))
        elif text:
            self._write(text + "\n")

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()


class _Cell:
    """Below a notebook's cell."""

    def __init__(self) -> None:
        self._handle: Any = None

    def show(self, fraction: float, text: str) -> None:
        bar = f'<progress max="1" value="{fraction:.4f}" style="width: 16em"></progress> {html.escape(text)}'
        self._display({"text/plain": text, "text/html": bar})

    def clear(self) -> None:
        """Nothing: what others print has lines of its own."""

    def end(self, text: str) -> None:
        self._display({"text/plain": text, "text/html": html.escape(text)})

    def _display(self, data: dict[str, str]) -> None:
        if self._handle is None:
            from IPython.display import display  # loaded already

            self._handle = display(data, raw=True, display_id=True)
        else:
            self._handle.update(data, raw=True)


def _duration(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = int(seconds) // 60
    return f"{minutes} min {int(seconds) % 60:02} s" if minutes < 60 else f"{minutes // 60} h {minutes % 60:02} min"


class Shown:
    """What one call shows. row() receives the rows of a run, work() the fraction of the call that is done."""

    def __init__(self, place: _Lines | _Cell) -> None:
        self._place, self._begin, self._run, self._drawn = place, time.monotonic(), "", False

    def row(self, values: dict[str, Any]) -> None:
        if values["closing"]:
            return
        level = f"level {values['level']}/{values['levels']}  " if values["levels"] else ""
        self._run = f"{level}iteration {values['iteration']}/{values['iterations']}  loss {values['loss']:.4g}"
        if self._drawn:
            self._place.clear()  # a callback may print

    def work(self, name: str, fraction: float, seconds: float) -> None:
        if time.monotonic() - self._begin < FIRST:
            return
        text = self._run or f"{name}: {100 * fraction:.0f} %"
        if fraction > 0.02:  # no estimate before
            text += f", {_duration(seconds * (1 - fraction) / fraction)} left"
        self._place.show(fraction, text)
        self._drawn = True

    def end(self) -> None:
        if self._drawn:
            self._place.end(f"{self._run}, {_duration(time.monotonic() - self._begin)}" if self._run else "")


class _Told:
    """As Shown, to a callable. Of a run only its rows: other work has no iterations."""

    def __init__(self, call: Callable[[float, float, float], Any], of_run: bool) -> None:
        self._call, self._of_run = call, of_run

    def row(self, values: dict[str, Any]) -> None:
        if not values["closing"]:
            self._call(values["iteration"], values["iterations"], values["loss"])

    def work(self, name: str, fraction: float, seconds: float) -> None:
        if not self._of_run:
            self._call(fraction, 1.0, math.nan)

    def end(self) -> None:
        if not self._of_run:
            self._call(1.0, 1.0, math.nan)


def _place(progress: Progress) -> _Lines | _Cell | None:
    if in_notebook():
        return _Cell()
    stream = sys.stderr
    return _Lines(stream) if stream is not None and (progress or stream.isatty()) else None


@contextlib.contextmanager
def showing(progress: Progress, core: Any, of_run: bool = False) -> Iterator[Shown | _Told | None]:
    """Shows within it what tasks of this thread have come to; None: nothing is shown. core: the extension. What callbacks do within a
    run is not shown."""
    shown: Shown | _Told | None = None
    before = core.watch_progress(None)
    if before is not None and progress is None:
        pass  # within a callback of a run that is shown
    elif callable(progress):
        shown = _Told(progress, of_run)
    elif progress is not False and (place := _place(progress)):
        shown = Shown(place)
    watcher = shown.work if shown else None  # the extension keeps no reference
    core.watch_progress(watcher)
    done = False
    try:
        yield shown
        done = True
    finally:
        core.watch_progress(before)
        if shown and (done or isinstance(shown, Shown)):
            shown.end()
