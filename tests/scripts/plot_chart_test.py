#!/usr/bin/python3
"""scripts/plot_chart.py on tables such as `isochron chart` and `isochron stability` write, with every odd entry."""

import pathlib
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "scripts" / "plot_chart.py"
sys.path.insert(0, str(SCRIPT.parent))
from in_process import run_script

CHART = """method,factor,repeats,core_seconds,error,variance,variance_error,bias2,bias2_error,components,unknowns
reference,,32,10,0.02,0.0004,,,,1,1
standard,1,10,0.1,0.5,0.25,0.05,0.001,0.01,1,1
standard,2,10,0.2,0.3,0.09,0.02,-0.001,0.01,1,1
finite_difference_0.1,1,10,0.1,0.4,0.01,0.002,0.15,0.01,1,1
paper,1,4,2,0,0,0,0,0,1,1
"""
TABLE = """method,core_seconds,standard_error,ratio,rate,slope,bias2,bias2_error,bias_significant
standard,200,20,1,0.02,-0.6,0.0001,0.001,false
finite_difference_0.1,inf,0,inf,0.001,-0.1,0.15,0.01,true
paper,0,0,0,0,nan,0,0,false
"""
SOLVERS = """method,seed,iteration,core_seconds,error
adam,1,0,0,1
adam,1,1,0.1,0.5
lbfgs,1,0,0,1
"""
STABILITY = """width,method,positive,error_ratio,failure
0.1,standard,1,0.01,
0.1,auto,1,nan,
0.001,standard,0.5,1.2,variance
0.001,auto,0.95,0,
"""


class PlotChartTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def plot(self, **tables):
        for name, text in tables.items():
            (self.folder / f"{name}.csv").write_text(text)
        return run_script(SCRIPT, self.folder)

    def test_all_pictures(self):
        result = self.plot(chart=CHART, chart_table=TABLE, chart_solvers=SOLVERS, stability=STABILITY)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        names = sorted(p.name for p in self.folder.glob("*.png*"))
        self.assertEqual(names, ["chart.png", "chart_solvers.png", "stability.png"])

    def test_one_picture(self):
        self.assertEqual(self.plot(stability=STABILITY).returncode, 0)
        self.assertEqual([p.name for p in self.folder.glob("*.png*")], ["stability.png"])

    def test_failures_in_one_line(self):
        for tables in ({}, {"chart": CHART}, {"chart": CHART[:20], "chart_table": TABLE}, {"stability": "width\n"}):
            for old in self.folder.glob("*.csv"):
                old.unlink()
            result = self.plot(**tables)
            self.assertEqual(result.returncode, 1, tables)
            self.assertRegex(result.stderr, r"\Aplot_chart\.py: .*\n\Z")


if __name__ == "__main__":
    unittest.main()
