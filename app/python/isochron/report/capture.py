"""What is particular to runs of captures: histograms of points of the wall, slices through all points over time, what was
found as who stands at the wall sees it, and how well the fit explains the counts."""

import numpy as np

from isochron.errors import InputError
from isochron.pictures.scales import scale_of
from isochron.report.charts import Chart, Series, grid
from isochron.report.images import Viewer, row_of, slice_of
from isochron.report.markup import Markup, element, join, number, section, some_of, table
from isochron.report.png import Scale, figure_uri

DEVIATIONS = 4.0  # end of the scale of residuals
MOST_SLICES = 25


def capture_section(run):
    if not run.is_capture or run.shape is None or len(run.shape) != 3:
        return Markup("")
    parts = [slices(run)]
    if (run.directory / "final.h5").exists():
        try:
            parts += fitted(run)
        except InputError as error:
            run.note(str(error))
    return section("capture", "The capture", *parts)


def slices(run):
    """Light of a row of points over time, as the iterations see it."""
    frames = run.frames()
    target = run.images.get("target")
    if not frames or target is None or run.gates is None:
        return None
    frames = some_of(frames, MOST_SLICES)
    where = row_of(run.shape)[1]
    counts = slice_of(target)
    scale = Scale("inferno", 0.0, scale_of(counts, slice_of(frames[-1][2])))
    poisson = str(run.map("loss").get("kind")) == "poisson"
    rest = [residual(counts, slice_of(image), poisson) for _, _, image in frames]
    bound = DEVIATIONS if poisson else scale_of(rest[0], rest[-1])
    signed = Scale("RdBu_r", -bound, bound)
    centres = run.gates.positions
    viewer = Viewer("slice", f"Slice over time: {where}", [label for label, _, _ in frames])
    style = f"aspect-ratio:{4 / 5:.3f}"
    viewer.add("image", [scale.uri(slice_of(image)) for _, _, image in frames], style)
    viewer.add("target" if run.map("target").get("capture") is None else "counts", scale.uri(counts), style)
    viewer.add("residual", [signed.uri(r) for r in rest], style)
    of_residual = "(counts − image) / √image, in standard deviations" if poisson else "target − image"
    words = (f"To the right: sensor points, {counts.shape[1]}. Downwards: {run.gates.axis}, "
             f"{number(centres[0], 5)} to {number(centres[-1], 5)}. Residual: {of_residual}.")
    return element("div", viewer.html(), scale.bar(run.quantity),
                   signed.bar("residual, blue where the image is too bright"), element("p", words, class_="note"))


def residual(counts, image, poisson):
    if not poisson:
        return counts - image
    # Images of a few samples hold zeros where there is light.
    floor = 0.02 * max(float(counts.mean()), 1e-12)
    return (counts - image) / np.sqrt(np.maximum(image, floor))


def fitted(run):
    # Imported here, as h5py and SciPy take longer to load than most pages to be written.
    from isochron.pictures.capture_run import CaptureRun

    capture = CaptureRun(run.directory)
    charts = []
    chosen = capture.wall.spread_points(capture.used_points)
    times = (capture.times[1:] + capture.times[:-1]) / 2
    for place, (column, row) in enumerate(chosen, start=1):
        counts, fit = capture.counts[:, column, row], capture.fit[:, column, row]
        lit = np.flatnonzero(np.maximum(counts, fit) > 0)
        some = slice(max(0, lit[0] - 5), lit[-1] + 6) if len(lit) else slice(None)
        charts.append(Chart(f"h{place}", f"Point {place}: column {column}, row {row}",
                            [Series("counts", times[some], counts[some]), Series("fit", times[some], fit[some])],
                            "time (ps)", "counts per bin", steps=True))
        with np.errstate(divide="ignore", invalid="ignore"):
            off = np.where(fit > 0, (counts - fit) / np.sqrt(fit), np.nan)
        charts.append(Chart(f"r{place}", f"Point {place}: residual", [Series("", times[some], off[some])], "time (ps)",
                            "(N − μ) / √μ", steps=True, height=220))
    yield element("h3", "Histograms of points of the wall")
    yield grid(charts)
    yield views(capture, chosen)


def views(capture, chosen):
    """The result as seen from the wall, and the data's back-projection."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from isochron.pictures.capture_sheet import STYLE
    from isochron.pictures.scene_views import draw_views

    with matplotlib.rc_context(STYLE):
        figure = plt.figure(figsize=(12, 4), layout="constrained")
        lines = draw_views(figure, capture, chosen, with_box=False)
        uri = figure_uri(figure)
        plt.close(figure)
    alt = "Seen from the wall: albedo and depth where they are unknowns, and the filtered back-projection of the counts"
    picture = element("figure", element("img", src=uri, alt=alt, class_="paper"), element("figcaption", alt + "."),
                      class_="card wide")
    return join([element("h3", "Result"), picture, element("div", *boxes(lines), class_="boxes")])


def boxes(lines):
    """A table for each heading and what stands below it; a line without a name goes on with the one above."""
    parts = []
    for name, value in lines:
        if value is None:
            parts.append((name, []))
        elif name.strip() or not parts[-1][1]:
            parts[-1][1].append([name.strip(), value])
        else:
            parts[-1][1][-1][1] += f", {value}"
    return [table([heading, "value"], rows) for heading, rows in parts]
