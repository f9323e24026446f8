"""Makes the package isochron importable: that of the checkout, or of the installation that the scripts are part of."""

import pathlib
import sys

_root = pathlib.Path(__file__).resolve().parents[1]
_checkout = _root / "app/python"
sys.path.insert(0, str(_checkout if _checkout.exists() else _root.parents[1] / "lib/python3/dist-packages"))
