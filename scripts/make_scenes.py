#!/usr/bin/python3
"""Writes the scenes of this repository: meshes and scene.yaml, one folder per scene.

usage: make_scenes.py [DIR]     DIR: default the repository's scenes/
"""

import pathlib
import sys

from scenes import branches, bunny, corner, corridor, cove, cube, glass_bunny, height_field, hidden_s, letter, rabbit, relief, sofa, tree

SCENES = (branches, bunny, corner, corridor, cove, cube, glass_bunny, height_field, hidden_s, letter, rabbit, relief, sofa, tree)


def main(arguments):
    if len(arguments) > 1 or any(a.startswith("-") for a in arguments):
        print(__doc__.strip())
        return 0 if arguments in (["-h"], ["--help"]) else 2
    default = pathlib.Path(__file__).resolve().parent.parent / "scenes"
    root = pathlib.Path(arguments[0]) if arguments else default
    for scene in SCENES:
        directory = root / scene.__name__.rpartition(".")[2]
        directory.mkdir(parents=True, exist_ok=True)
        scene.write(directory)
        (directory / "scene.yaml").write_text(scene.SCENE, encoding="ascii")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
