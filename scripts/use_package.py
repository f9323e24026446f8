"""Makes the package isochron importable from the checkout, where nothing is installed."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "app/python"))
