"""Line charts as SVG in the page's own colours, each with a table of some of its values for who cannot see it."""

import json
import math

import numpy as np

from isochron.report.markup import Markup, element, escape, join, number, table

WIDTH, HEIGHT = 560, 300
LEFT, RIGHT, TOP, BOTTOM = 66, 26, 12, 56
MOST_POINTS, MOST_ROWS = 400, 12


class Series:
    """y over x. `band`: half the height of a strip around it. `target`: a dashed line. `final`: where it ends, with a bar of
    ± `error`."""

    def __init__(self, name, x, y, band=None, target=None, error=None, final=None):
        self.name, self.x, self.y = name, np.asarray(x, float), np.asarray(y, float)
        self.band = None if band is None else np.nan_to_num(np.asarray(band, float))
        self.target, self.error, self.final = target, error, final


def nice_ticks(low, high, count=5):
    span = (high - low) or 1
    step = 10 ** math.floor(math.log10(span / count))
    step *= next(m for m in (1, 2, 5, 10) if span / (m * step) <= count)
    first = math.ceil(low / step - 1e-9)
    return [k * step for k in range(first, math.floor(high / step + 1e-9) + 1)]


def log_ticks(low, high):
    first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
    subs = (1,) if last - first > 3 else (1, 2, 5)
    ticks = [s * 10.0**e for e in range(first, last + 1) for s in subs if low <= s * 10.0**e <= high]
    step = -(-len(ticks) // 8) or 1
    return ticks[::step]


def thinned(count):
    return np.unique(np.linspace(0, count - 1, min(count, MOST_POINTS)).round().astype(int))


class Chart:
    """`times`: seconds at each iteration, written below the ticks of the horizontal axis."""

    def __init__(self, key, title, series, x_label, y_label, log=False, times=None, note=None, steps=False, height=HEIGHT):
        self.key, self.title, self.x_label, self.y_label = key, title, x_label, y_label
        self.times, self.note, self.steps, self.height = times, note, steps, height
        self.bottom = height - (BOTTOM if times is not None else BOTTOM - 14)
        self.series = [s for s in series if np.isfinite(s.y).any()]
        positive = np.concatenate([s.y[np.isfinite(s.y) & (s.y > 0)] for s in self.series] or [np.empty(0)])
        self.log = log and positive.size > 0 and positive.max() > 3 * positive.min()
        self.positive = positive

    def _ranges(self):
        xs = np.concatenate([s.x for s in self.series])
        self.x0, self.x1 = float(np.nanmin(xs)), float(np.nanmax(xs))
        if self.x1 <= self.x0:
            self.x0, self.x1 = self.x0 - 0.5, self.x0 + 0.5
        if self.log:
            low, high = math.log10(self.positive.min()), math.log10(self.positive.max())
            margin = 0.04 * (high - low)
            self.y0, self.y1 = low - margin, high + margin
            return
        values = []
        for s in self.series:
            values += [s.y[np.isfinite(s.y)]]
            if s.target is not None and np.isfinite(s.target):
                values.append(np.array([s.target]))
            if s.error is not None and np.isfinite(s.error) and s.final is not None:
                values.append(np.array([s.final - s.error, s.final + s.error]))
        values = np.concatenate(values)
        low, high = float(values.min()), float(values.max())
        margin = 0.06 * (high - low) or 0.5 * abs(high) or 0.5
        self.y0, self.y1 = low - margin, high + margin

    def _x(self, value):
        return LEFT + (value - self.x0) / (self.x1 - self.x0) * (WIDTH - LEFT - RIGHT)

    def _y(self, value):
        if self.log:
            value = np.log10(np.where(value > 0, value, np.nan))
        unit = (value - self.y0) / (self.y1 - self.y0)
        return TOP + (1 - np.clip(unit, -0.5, 1.5)) * (self.bottom - TOP)

    def _axes(self):
        right, bottom = WIDTH - RIGHT, self.bottom
        parts = []
        for tick in (log_ticks(10**self.y0, 10**self.y1) if self.log else nice_ticks(self.y0, self.y1)):
            y, words = float(self._y(np.float64(tick))), number(0 if abs(tick) < 1e-300 else tick)
            parts.append(f'<line class="grid" x1="{LEFT}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}"/>'
                         f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{words}</text>')
        for tick in nice_ticks(self.x0, self.x1, 6):
            if self.times is not None and abs(tick - round(tick)) > 1e-9:
                continue  # no half iterations
            x = self._x(tick)
            parts.append(f'<line class="axis" x1="{x:.1f}" x2="{x:.1f}" y1="{bottom}" y2="{bottom + 4}"/>'
                         f'<text x="{x:.1f}" y="{bottom + 17}" text-anchor="middle">{number(tick, 6)}</text>')
            row = int(round(tick))
            if self.times is not None and 0 <= row < len(self.times) and abs(tick - row) < 1e-9:
                parts.append(f'<text class="quiet" x="{x:.1f}" y="{bottom + 31}" text-anchor="middle">'
                             f'{number(self.times[row], 3)} s</text>')
        parts.append(f'<line class="axis" x1="{LEFT}" x2="{right}" y1="{bottom}" y2="{bottom}"/>')
        for place, words in ((f'x="{(LEFT + right) / 2:.0f}" y="{self.height - 8}"', self.x_label),
                             (f'transform="translate(13,{(TOP + bottom) / 2:.0f}) rotate(-90)"', self.y_label)):
            parts.append(f'<text {place} text-anchor="middle">{escape(words)}</text>')
        return parts

    def _line(self, s, index):
        colour = f"s{index % 8}"
        rows = thinned(len(s.x))
        x, y = self._x(s.x[rows]), self._y(s.y[rows])
        parts = []
        if s.target is not None and np.isfinite(s.target) and not (self.log and s.target <= 0):
            at = float(self._y(np.float64(s.target)))
            parts.append(f'<line class="target {colour}" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{at:.1f}" y2="{at:.1f}"/>')
        if s.band is not None:
            parts.append(self._band(s, rows, x, colour))
        words, pen = [], False
        for a, b in zip(x, y):
            if not np.isfinite(b):
                pen = False
                continue
            if self.steps and pen:
                words.append(f"H{a:.1f}V{b:.1f}")
            else:
                # A point between two gaps is a line without a length, whose ends are round.
                words.append(f"L{a:.1f} {b:.1f}" if pen else f"M{a:.1f} {b:.1f}h0")
            pen = True
        parts.append(f'<path class="line {colour}" d="{"".join(words)}"/>')
        if np.isfinite(y).sum() <= 30 and not self.steps:
            parts += [f'<circle class="dot {colour}" cx="{a:.1f}" cy="{b:.1f}" r="2.5"/>' for a, b in zip(x, y)
                      if np.isfinite(b)]
        if s.final is not None and np.isfinite(s.final) and not (self.log and s.final <= 0):
            a, b = x[-1], float(self._y(np.float64(s.final)))
            if s.error is not None and np.isfinite(s.error) and not self.log:
                low, high = (float(self._y(np.float64(s.final + sign * s.error))) for sign in (-1, 1))
                ends = "".join(f"M{a - 4:.1f} {end:.1f}h8" for end in (low, high))
                parts.append(f'<path class="error {colour}" d="M{a:.1f} {low:.1f}V{high:.1f}{ends}"/>')
            parts.append(f'<circle class="final {colour}" cx="{a:.1f}" cy="{b:.1f}" r="4"/>')
        return "".join(parts)

    def _band(self, s, rows, x, colour):
        low, high = s.y[rows] - s.band[rows], s.y[rows] + s.band[rows]
        floor = 10**self.y0 if self.log else -np.inf
        good = np.isfinite(low) & np.isfinite(high) & (high > floor)
        if not good.any():
            return ""
        upper = [f"{a:.1f} {b:.1f}" for a, b in zip(x[good], self._y(high[good]))]
        lower = [f"{a:.1f} {b:.1f}" for a, b in zip(x[good], self._y(np.maximum(low[good], floor)))]
        return f'<path class="band {colour}" d="M{"L".join(upper + lower[::-1])}Z"/>'

    def _table(self):
        if all(len(s.x) == len(self.series[0].x) and np.array_equal(s.x, self.series[0].x) for s in self.series):
            rows = np.unique(np.linspace(0, len(self.series[0].x) - 1, MOST_ROWS).round().astype(int))
            head = [self.x_label] + [s.name or self.y_label for s in self.series]
            body = [[number(self.series[0].x[r], 6)] + [number(s.y[r], 5) for s in self.series] for r in rows]
        else:
            head = ["curve", "first", "last", "least"]
            body = [[s.name, *(number(v, 5) for v in (s.y[0], s.y[-1], np.nanmin(s.y)))] for s in self.series]
        return element("details", element("summary", "Values"), table(head, body, f"{self.title}: some values"))

    def _legend(self):
        entries = [element("li", element("span", class_=f"key s{i % 8}", aria_hidden="true"), " ", s.name)
                   for i, s in enumerate(self.series) if s.name]
        return element("ul", *entries, class_="legend") if entries else Markup("")

    def description(self):
        words = [f"{self.y_label} over {self.x_label}."]
        for s in self.series[:8]:
            finite = s.y[np.isfinite(s.y)]
            words.append(f"{s.name or 'The curve'} goes from {number(finite[0])} to {number(finite[-1])}"
                         + (f", target {number(s.target)}" if s.target is not None and np.isfinite(s.target) else "") + ".")
        return " ".join(words)

    def html(self):
        if not self.series:
            return Markup("")
        self._ranges()
        clip = f"clip-{self.key}"
        lines = "".join(self._line(s, i) for i, s in enumerate(self.series))
        rows = [thinned(len(s.x)) for s in self.series]
        data = json.dumps({"left": LEFT, "right": RIGHT, "x0": self.x0, "x1": self.x1, "bottom": self.bottom,
                           "label": self.x_label, "series": [
                               {"name": s.name, "x": [round(float(v), 6) for v in s.x[r]],
                                "y": [float(f"{v:.5g}") if np.isfinite(v) else None for v in s.y[r]]}
                               for s, r in zip(self.series, rows)]})
        svg = Markup(f'<svg viewBox="0 0 {WIDTH} {self.height}" role="img" aria-labelledby="{self.key}-t {self.key}-d" '
                     f'class="chart" data-chart="{escape(data)}"><title id="{self.key}-t">{escape(self.title)}</title>'
                     f'<desc id="{self.key}-d">{escape(self.description())}</desc>'
                     f'<clipPath id="{clip}"><rect x="{LEFT - 5}" y="{TOP - 5}" width="{WIDTH - LEFT - RIGHT + 10}" '
                     f'height="{self.bottom - TOP + 10}"/></clipPath>{"".join(self._axes())}'
                     f'<g clip-path="url(#{clip})">{lines}</g></svg>')
        note = element("p", self.note, class_="note") if self.note else None
        readout = element("p", class_="readout", aria_hidden="true")
        return element("figure", element("figcaption", element("h3", self.title), self._legend()), svg, readout, note,
                       self._table(), class_="card")


def grid(charts):
    drawn = [chart.html() for chart in charts]
    return element("div", join(d for d in drawn if d), class_="cards") if any(drawn) else Markup("")
