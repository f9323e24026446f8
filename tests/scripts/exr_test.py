#!/usr/bin/python3
"""isochron.exr against files written by OpenEXR, and its writer against its reader.

usage: exr_test.py PROGRAM     PROGRAM: the built write_exr_samples
"""

import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "app/python"))
from isochron import exr
import numpy as np

NAMES = ["gate000.Y", "interior.gate001.Y", "path_length.gate010.with.a.long.name.Y"]
WIDTH, HEIGHT = 21, 37


def pixels(smooth, channel):
    """The same formulas stand in write_exr_samples.cpp."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    if smooth:
        return ((channel + 1) * (x / 4 - y)).astype(np.float32)
    index = ((channel * HEIGHT + y) * WIDTH + x).astype(np.uint64)
    bits = (index * 2654435761 & 0xBF7FFFFF).astype(np.uint32)
    return bits.view(np.float32)


class ExrTest(unittest.TestCase):
    program = ""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def assert_same_bits(self, actual, expected):
        np.testing.assert_array_equal(actual.view(np.uint32), expected.view(np.uint32))

    def test_reads_what_openexr_writes(self):
        subprocess.run([self.program, str(self.folder)], check=True)
        for compression in ("none", "zips", "zip"):
            for kind in ("smooth", "rough", "smooth_tiles", "rough_tiles"):
                with self.subTest(compression=compression, kind=kind):
                    images = exr.read(self.folder / f"{compression}_{kind}.exr")
                    self.assertEqual(sorted(images), NAMES)
                    for channel, name in enumerate(NAMES):
                        self.assert_same_bits(images[name], pixels(kind.startswith("smooth"), channel))

    def test_reads_some_channels(self):
        subprocess.run([self.program, str(self.folder)], check=True)
        for compression in ("none", "zips", "zip"):
            for kind in ("smooth", "rough", "smooth_tiles", "rough_tiles"):
                for chosen in ({NAMES[1]}, {NAMES[0], NAMES[2]}, set()):
                    with self.subTest(compression=compression, kind=kind, chosen=chosen):
                        images = exr.read(self.folder / f"{compression}_{kind}.exr", chosen)
                        self.assertEqual(set(images), chosen)
                        for name, image in images.items():
                            self.assert_same_bits(image, pixels(kind.startswith("smooth"), NAMES.index(name)))
        self.assertEqual(exr.channel_names(self.folder / "zip_smooth.exr"), NAMES)

    def test_reads_what_it_writes(self):
        for smooth in (True, False):
            images = {name: pixels(smooth, channel) for channel, name in enumerate(NAMES)}
            exr.write(self.folder / "own.exr", images)
            back = exr.read(self.folder / "own.exr")
            for name in NAMES:
                self.assert_same_bits(back[name], images[name])

    def test_says_what_is_wrong(self):
        path = self.folder / "bad.exr"
        path.write_bytes(b"no image at all")
        for action in exr.read, exr.attributes, exr.channel_names:
            with self.assertRaisesRegex(exr.ExrError, rf"^{path}: not an OpenEXR file$"):
                action(path)
        exr.write(path, {"gate000.Y": pixels(False, 0)})
        whole = path.read_bytes()
        for length in range(8, len(whole), 97):
            path.write_bytes(whole[:length])
            with self.assertRaisesRegex(exr.ExrError, rf"^{path}: damaged"):
                exr.read(path)
        self.assertEqual(list(self.folder.glob(".*")), [])


if __name__ == "__main__":
    ExrTest.program = sys.argv.pop(1)
    unittest.main()
