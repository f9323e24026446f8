"""Images over the iterations: for each gate a slider over image, target and difference; derivative images term by term."""

import numpy as np

from isochron.pictures.reading import Gates, read_stack, read_yaml
from isochron.pictures.scales import pick_gates, scale_of
from isochron.pictures.sheets import COMPONENTS
from isochron.report.markup import Markup, data_for_scripts, element, number, section, some_of
from isochron.report.png import ColourScale, Scale, shrunk

MOST_BYTES = 6e6  # of all pictures before they are compressed
MOST_GATES, MOST_FRAMES = 24, 25
MOST_PIXELS = 256  # along the longer side
FEW_GATES = 6  # of derivatives


def row_of(shape):
    """How a row of a capture's points is taken from its gates (see slice_of), and which one that is."""
    rows, columns = shape[1:3]
    if columns == 1:
        return (slice(None), slice(None), 0), "the only column"
    return (slice(None), rows // 2), f"row {rows // 2}, the middle one of {rows}" if rows > 1 else "the only row"


def slice_of(stack):
    """Gates downwards, a row of points to the right."""
    return stack[row_of(stack.shape)[0]]


class Plan:
    """Which gates and frames are shown, and by what factor pictures are shrunk, so that the page stays small."""

    def __init__(self, run, frames):
        height, width = run.shape[1:3]
        self.factor = max(1, -(-max(height, width) // MOST_PIXELS))
        gates, count = min(run.shape[0], MOST_GATES), min(len(frames), MOST_FRAMES)

        def size():
            pixels = (height // self.factor) * (width // self.factor)
            return pixels * gates * (count + 1) * (1 + (3 if len(run.shape) == 4 else 1))

        while size() > MOST_BYTES and (gates > 2 or count > 3):
            if gates > 8 or (gates > 2 and count <= 7):
                gates = max(2, gates * 2 // 3)
            else:
                count = max(3, count * 2 // 3)
        self.frames = some_of(frames, count)
        stacks = [run.images[n] for n in ("target", "initial", "final") if n in run.images]
        self.gates = pick_gates(gates, *stacks)
        self.left_out = run.shape[0] - len(self.gates)

    def view(self, image):
        """One gate's image at the size in which it is shown."""
        return shrunk(image, self.factor)


def grey(image):
    return image.mean(-1) if image.ndim == 3 else image


def root_mean_square(values):
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


class Viewer:
    """Pictures side by side that a slider changes. `steps` is a label per step; pictures are lists of URIs, one per step, or
    a single one that stays."""

    def __init__(self, key, title, steps):
        self.key, self.title, self.steps, self.figures, self.data = key, title, steps, [], []
        self.words = [""] * len(steps)

    def add(self, name, uris, style=None):
        moving = isinstance(uris, list)
        shown = uris[-1] if moving else uris
        alt = f"{self.title}: {name}" + (f", {self.steps[-1]}" if moving else "")
        self.figures.append(element("figure", element("img", src=shown, alt=alt, style=style,
                                                      data_moving=str(len(self.data)) if moving else None),
                                    element("figcaption", name)))
        if moving:
            self.data.append(uris)

    def html(self):
        last = len(self.steps) - 1
        slider = element("label", element("span", "Iteration", class_="sr"),
                         element("input", type="range", min="0", max=last, value=last, step="1", id=f"{self.key}-slider",
                                 aria_valuetext=self.steps[-1], aria_label=f"{self.title}: iteration"), class_="slider")
        # What a screen reader hears is the slider's text.
        output = element("p", f"{self.steps[-1]}{self.words[-1]}", class_="step", aria_hidden="true")
        data = {"steps": self.steps, "words": self.words, "pictures": self.data}
        return element("article", element("h3", self.title), element("div", *self.figures, class_="pictures"), output,
                       slider if last > 0 else None,
                       data_for_scripts(data), class_="card viewer")


def images_section(run):
    frames = run.frames() if run.shape is not None else []
    if not frames or run.gates is None:
        return Markup("")
    plan = Plan(run, frames)
    target = run.images.get("target")
    stacks = [target] if target is not None else []
    stacks += [plan.frames[0][2], plan.frames[-1][2]]
    colour = len(run.shape) == 4
    scale = ColourScale(scale_of(*stacks)) if colour else Scale("inferno", 0.0, scale_of(*stacks))
    difference = None
    if target is not None and target.shape == run.shape:
        rest = [f[2] - target for f in (plan.frames[0], plan.frames[-1])]
        bound = scale_of(*(grey_stack(r) for r in rest))
        difference = Scale("RdBu_r", -bound, bound)
    style = f"aspect-ratio:{run.shape[2]}/{run.shape[1]}"
    viewers = [viewer_of(run, plan, gate, scale, difference, style) for gate in plan.gates]
    notes = [scale.bar(f"image and target: {run.quantity}")]
    if difference is not None:
        notes.append(difference.bar("difference: image − target, blue where the image is too dark"))
    words = "Magenta: values that are not finite. " if any(not np.isfinite(f[2]).all() for f in plan.frames) else ""
    if plan.left_out:
        words += f"{len(plan.gates)} of {run.shape[0]} gates, evenly spread over those that hold light. "
    if plan.factor > 1:
        words += f"Pixels are means over {plan.factor} x {plan.factor}. "
    if len(plan.frames) == 1:
        words += "The run kept no images over its iterations. "
    if words:
        notes.append(element("p", words, class_="note"))
    if len(viewers) > 1 and len(frames) > 1:
        box = element("input", type="checkbox", checked=True, id="together")
        notes.append(element("p", element("label", box, " move all gates together"), class_="controls"))
    return section("images", "Images over the iterations", *notes, element("div", *viewers, class_="viewers"))


def grey_stack(stack):
    return stack.mean(-1) if stack.ndim == 4 else stack


def viewer_of(run, plan, gate, scale, difference, style):
    unit = "" if run.gates.centers is None else f" {run.gates.unit}"
    title = f"Gate at {run.gates.label(gate)}{unit}" if run.gates.centers is not None else f"Gate {gate}"
    viewer = Viewer(f"gate{gate}", title, [label for label, _, _ in plan.frames])
    viewer.add("image", [scale.uri(plan.view(image[gate])) for _, _, image in plan.frames], style)
    target = run.images.get("target")
    if target is not None and target.shape == run.shape:
        viewer.add("target", scale.uri(plan.view(target[gate])), style)
        rest = [image[gate] - target[gate] for _, _, image in plan.frames]
        viewer.add("difference", [difference.uri(grey(plan.view(r))) for r in rest], style)
        viewer.words = [f", RMS of the difference {number(root_mean_square(r), 3)}" for r in rest]
    return viewer.html()


def derivative_files(run):
    """(path, where it comes from): of `isochron derive` in the folder, else what the report rendered."""
    images = {"target", "initial", "final", "render"} - {p.name for p in run.parameters}
    own = [p for p in sorted(run.directory.glob("*.exr")) if p.stem not in images]
    if own:
        return own, "from derive's files in the folder"
    folder = run.directory / "report/derivatives"
    paths = sorted(folder.glob("*.exr"))
    order = [p.name for p in run.parameters]
    paths.sort(key=lambda p: order.index(p.stem.split("[")[0]) if p.stem.split("[")[0] in order else len(order))
    about = run.read(read_yaml, "report/derivatives/derivatives.yaml") or {}
    return paths, f"at the final parameters, {about.get('samples', 'few')} samples per pixel and term"


def derivatives_section(run):
    paths, words = derivative_files(run)
    blocks = []
    for path in paths[:8]:
        stacks = run.read(read_stack, str(path.relative_to(run.directory)))
        if stacks and "total" in stacks:
            blocks.append(derivative_of(run, path.stem, stacks))
    if not blocks:
        return Markup("")
    left_out = f" The first 8 of {len(paths)}." if len(paths) > 8 else ""
    note = (f"Derivatives of the images, {words}. Each is the sum of the terms below it; red: more light as the parameter "
            f"grows.{left_out}")
    return section("derivatives", "Derivative images, term by term", element("p", note, class_="note"), *blocks)


def derivative_of(run, name, stacks):
    parts = {c: stacks[c] for c in COMPONENTS if c in stacks}
    zero = [c for c, s in parts.items() if not np.any(np.nan_to_num(s, nan=1))]
    drawn = {c: s for c, s in parts.items() if c not in zero}
    if len(drawn) == 2 and np.array_equal(*drawn.values()):
        drawn = {" = ".join(drawn): next(iter(drawn.values()))}
    if not drawn:
        return element("article", element("h3", name), element("p", "Zero everywhere."), class_="card")
    first = next(iter(drawn.values()))
    if run.is_capture:
        views = {c: [(row_of(s.shape)[1], slice_of(s))] for c, s in drawn.items()}
        style, words = "aspect-ratio:0.8", "To the right: sensor points; downwards: time. "
    else:
        gates = pick_gates(FEW_GATES, *drawn.values())
        factor = max(1, -(-max(first.shape[1:3]) // 128))
        labels = run.gates if run.gates is not None and run.gates.count == len(first) else Gates(len(first))
        views = {c: [(labels.label(g), shrunk(s[g], factor)) for g in gates] for c, s in drawn.items()}
        style, words = f"aspect-ratio:{first.shape[2]}/{first.shape[1]}", ""
    bound = scale_of(*(values for row in views.values() for _, values in row))
    scale = Scale("RdBu_r", -bound, bound)
    rows = []
    for component, row in views.items():
        pictures = []
        for label, values in row:
            pictures.append(element("figure", element("img", src=scale.uri(values), style=style,
                                                      alt=f"derivative by {name}, {component.replace('_', ' ')}, {label}"),
                                    element("figcaption", label)))
        rows.append(element("div", element("p", component.replace("_", " "), class_="term"), *pictures,
                            class_="row" if len(pictures) > 1 else "row one"))
    words += f"Zero everywhere: {', '.join(z.replace('_', ' ') for z in zero)}." if zero else ""
    return element("article", element("h3", f"By {name}"), *rows, scale.bar(f"d({run.quantity}) / d({name})"),
                   element("p", words, class_="note") if words else None, class_="card wide")
