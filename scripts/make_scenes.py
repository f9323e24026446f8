#!/usr/bin/python3
"""Writes the scenes of this repository: meshes and scene.yaml, one folder per scene.

usage: make_scenes.py [DIR]     DIR: default the repository's scenes/
"""

import pathlib
import sys

from scenes import branches, bunny, corner, corridor, cove, cube, glass_bunny, height_field, hidden_s, letter, rabbit, relief, sofa, tree

SCENES = {
    "branches": branches.write,
    "bunny": bunny.write,
    "corner": corner.write,
    "corridor": corridor.write,
    "cove": cove.write,
    "cube": cube.write,
    "glass_bunny": glass_bunny.write,
    "height_field": height_field.write,
    "hidden_s": hidden_s.write,
    "letter": letter.write,
    "rabbit": rabbit.write,
    "relief": relief.write,
    "sofa": sofa.write,
    "tree": tree.write,
}


def main(arguments):
    if len(arguments) > 1 or any(a.startswith("-") for a in arguments):
        print(__doc__.strip())
        return 0 if arguments in (["-h"], ["--help"]) else 2
    default = pathlib.Path(__file__).resolve().parent.parent / "scenes"
    root = pathlib.Path(arguments[0]) if arguments else default
    for name, write in SCENES.items():
        directory = root / name
        directory.mkdir(parents=True, exist_ok=True)
        write(directory)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
