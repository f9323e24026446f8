"""Which tests of a script run: with `--long` those marked so, which take some seconds of a processor, otherwise the others."""

import sys
import unittest


def long(test):
    test.is_long = True
    return test


def main():
    wanted = "--long" in sys.argv
    if wanted:
        sys.argv.remove("--long")

    class Loader(unittest.TestLoader):
        def getTestCaseNames(self, case):
            return [n for n in super().getTestCaseNames(case) if hasattr(getattr(case, n), "is_long") == wanted]

    unittest.main(testLoader=Loader())
