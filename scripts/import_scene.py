#!/usr/bin/python3
"""Converts a scene of Mitsuba (3, 0.5, 0.6) or of mitransient, an XML file, to a folder with a scene, its meshes and an experiment.

  scripts/import_scene.py cbox.xml -o my/cbox -D res=64
  build/isochron render my/cbox/experiment.yaml

Elements that cannot be converted are named with their line, and nothing is written (exit status 2). With --skip they are left out, as
long as a camera and a shape remain; an unknown material becomes a diffuse one of albedo 0.5. scenes/README.md lists the conversions.
"""

import argparse
import os
import pathlib
import shutil
import sys
import tempfile

import numpy as np
import use_package
from isochron.command_line import Parser
from mitsuba_scenes.document import SceneError
from mitsuba_scenes.report import Report
from mitsuba_scenes.turning import turned


def write_folder(folder, files, force):
    """All of it or nothing: into a folder beside it, which then takes its name."""
    if folder.exists() and not (force and (folder / "scene.yaml").is_file()):
        reason = "is there and holds no scene.yaml" if force else "is there already (--force replaces a scene)"
        raise SceneError(folder, reason)
    new = None
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        new = pathlib.Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
        new.chmod(0o777 & ~umask())
        for name, content in files.items():
            (new / name).write_bytes(content.encode() if isinstance(content, str) else content)
        replace(folder, new)
    except OSError as error:
        raise SceneError(folder, f"cannot be written: {error.strerror}") from None
    finally:
        if new is not None:
            shutil.rmtree(new, ignore_errors=True)


def replace(folder, new):
    old = new.with_name(new.name + ".old")
    if folder.exists():
        os.rename(folder, old)
    try:
        os.rename(new, folder)
    except BaseException:
        if old.exists() and not folder.exists():
            os.rename(old, folder)
        raise
    shutil.rmtree(old, ignore_errors=True)


def umask():
    value = os.umask(0)
    os.umask(value)
    return value


def definition(text):
    name, equals, value = text.partition("=")
    if not name or not equals:
        raise argparse.ArgumentTypeError(f"'{text}' is not name=value")
    return name, value


def ranged(kind, low, high):
    def read(text):
        value = kind(text)
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"{text} is not between {low} and {high}")
        return value

    read.__name__ = kind.__name__
    return read


def coordinates(count):
    def read(text):
        values = np.array([float(word) for word in text.split(",")])
        if len(values) != count or not np.isfinite(values).all():
            raise argparse.ArgumentTypeError(f"'{text}' is not {count} numbers")
        return values

    read.__name__ = "list of numbers"
    return read


def parse(arguments):
    parser = Parser(prog="import_scene.py", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("scene", metavar="SCENE.xml", type=pathlib.Path)
    add("-o", "--output", metavar="DIR", type=pathlib.Path, help="the folder (default: the scene's name, here)")
    add("--force", action="store_true", help="replace an earlier scene in the folder")
    add("-D", "--define", metavar="NAME=VALUE", type=definition, action="append", default=[],
        help="the value of $NAME in the scene")
    add("--skip", action="store_true", help="leave out what cannot be converted")
    add("--sensor", metavar="ID", help="which sensor, where there are several (default: the first)")
    add("--mean-textures", action="store_true", help="bitmaps and checkerboards become their mean colour")
    add("--fineness", metavar="N", type=ranged(int, 1, 8), default=4,
        help="a sphere has 20 x 4^N triangles, a disk and a cylinder 4 x 2^N sides (default: 4)")
    add("--smooth", metavar="ALPHA", type=ranged(float, 0.001, 1), default=0.05,
        help="roughness for smooth conductors and dielectrics (default: 0.05)")
    add("--max-bounces", metavar="N", type=ranged(int, 0, 1000), default=8,
        help="max_bounces if the integrator has no limit (default: 8)")
    add("--laser-pixel", metavar="X,Y", type=coordinates(2),
        help="of a capture: the film's pixel that the laser is aimed at, as in mitransient, where 0,0 is the corner")
    add("--laser-point", metavar="X,Y,Z", type=coordinates(3), help="of a capture: the point that the laser is aimed at")
    options = parser.parse_args(arguments)
    options.define = dict(options.define)
    options.output = options.output or pathlib.Path(options.scene.stem)
    return options


def import_scene(options):
    report = Report()
    try:
        files = turned(options.scene, options, report)
    except SceneError as error:
        report.refuse(error)
        files = None
    for line in report.by_line(report.refused):
        print(f"import_scene.py: {line}", file=sys.stderr)
    if files is None or report.refused and not options.skip:
        return 2
    write_folder(options.output, files, options.force)
    for line in report.by_line(report.notes):
        print(line)
    print(f"{options.output}: scene.yaml, experiment.yaml; OBJ files: {sum(name.endswith('.obj') for name in files)}")
    return 0


def main(arguments):
    options = parse(arguments)
    try:
        return import_scene(options)
    except SceneError as error:
        print(f"import_scene.py: {error}", file=sys.stderr)
        return 2
    except RecursionError:
        print(f"import_scene.py: {options.scene}: objects refer to each other in a circle", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
