"""What is measured: one step after the other, each with its commands and where a reader finds what came of it."""

import os
import pathlib
from dataclasses import dataclass

from reproduction.catalogue import RECONSTRUCTIONS

# What the numbers of every step depend on, beside its own programs: the version of a measurement is that of the last commit that
# changed any of these. No step remeshes.
SOURCES = ("CMakeLists.txt", "app/*.cpp", "app/*.h", "core", "optim", "scenes", "experiments/*.yaml", "tests/benchmark/*.h",
           "tests/data/cornell", ":!*.md", ":!optim/remesh", ":!optim/reconstruct", ":!experiments/rabbit.yaml")
CHARTED = ("cube", "branches", "corridor", "tree", "height_field", "bunny", "sofa")
CHART_SECONDS = {"cube": 240, "bunny": 120}  # where the gradient has to stand out of much noise; 60 for the others
BY_CHANCE = ("cube", "cube_standard")  # runs that noise alone can lead away, so that there are many of them
BIASED = ("corridor_3bounce", "corridor_fd", "height_field_steady")  # counterparts that fail with every seed


@dataclass(frozen=True)
class Step:
    commands: tuple  # words each; from the top of the repository
    environment: tuple = ()  # pairs
    removed: tuple = ()  # files that would keep older rows

    @property
    def programs(self):
        """Sources of the programs that this step alone runs."""
        names = [words[0].removeprefix("build/isochron_") for words in self.commands if words[0].startswith("build/isochron_")]
        # Figure 1 is drawn from what `isochron` itself renders.
        names += [f"figure{words[1]}" for words in self.commands if words[0] == "scripts/figure" and words[1] != "1"]
        return tuple(f"tests/benchmark/measure/{name}.cpp" for name in dict.fromkeys(names))


def _built(name, *arguments):
    return (f"build/isochron_{name}", *arguments)


def _script(name, *arguments):
    return (f"scripts/{name}", *arguments)


def _csv(name):
    return f"experiments/measured/{name}.csv"


def _reproduce(name):
    count = 5 if name in BY_CHANCE else 1 if name in BIASED else 2
    seeds = map(str, range(1, 1 + count))
    return Step((_script("reproduce", name, "--seeds", *seeds),), removed=(_csv(f"reconstructions/{name}"),))


def _chart(name):
    return Step((_script("charts", name),), (("SECONDS_EACH", str(CHART_SECONDS.get(name, 60))),))


STEPS = {
    "speed": Step((_built("measure", _csv("performance"), "9"),)),
    "set_up": Step((_built("set_up", _csv("set_up"), "9"),)),
    "cubes": Step((_script("cube_cost.py", "measure", _csv("cube_cost")),)),
    **{f"figure{n}": Step((_script("figure", n),)) for n in ("1", "8", "9")},
    **{f"reconstructions/{name}": _reproduce(name) for name in RECONSTRUCTIONS},
    **{f"charts/{name}": _chart(name) for name in (*CHARTED, "solvers", "stability")},
    "gate_width": Step((_built("gate_width", "cost", _csv("gate_width"), "24"),
                        _script("plot_gate_width.py", _csv("gate_width"), "experiments/figures/gate_width.png"),
                        _built("gate_width", "growth", _csv("width_growth"), "24"),
                        _script("plot_gate_width.py", _csv("width_growth"), "experiments/figures/width_growth.png"))),
    "boundary": Step((_built("boundary", _csv("boundary"), "64"),)),
    "hidden_share": Step((_built("hidden_share", _csv("hidden_share"), "16"),)),
    "light_share": Step((_built("light_share", _csv("light_share"), "4"),)),
    "technique_trial": Step((_built("technique_trial", _csv("technique_trial"), "4"),)),
    "capture_cost": Step((_script("capture_cost.py", "measure", _csv("capture_cost")),)),
    "stated_errors": Step((_script("error_coverage.py", "measure", _csv("error_coverage")),)),
    "intervals": Step((_script("interval_coverage.py", "measure", _csv("interval_coverage")),)),
    "checks": Step((_script("check_experiments.py", _csv("checks")),)),
    "contact": Step((_built("contact", _csv("contact"), "1"),)),
}


def egg(folder):
    """The public scene of "Differentiable Transient Rendering" (Yi et al. 2021), which is not part of this repository."""
    scene = os.fspath(pathlib.Path(folder).resolve() / "scene.xml")
    picture = "experiments/figures/egg.png"
    return {"egg": Step((_script("public_scene.py", "measure", scene, "emitter_right,shape_2", "0,1,0", _csv("egg"), picture),))}
