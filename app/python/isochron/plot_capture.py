"""Draws one sheet about the run of a capture: histograms of four points of the wall with the fit and its residuals; a
row of points over time; the recovered albedo and depth and the data's back-projection, as who stands at the wall and
looks along its normal sees them; and how well the fit explains the counts.

usage: plot_capture.py RUN [-o PNG]

  RUN     folder of a finished run whose scene has the key `capture`
  -o PNG  default: RUN/capture.png

Of several spots of the laser it shows the first.
"""

import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
from isochron.command_line import Parser
from isochron.errors import InputError
from isochron.pictures.capture_run import CaptureRun
from isochron.pictures.capture_sheet import draw_sheet


def main(arguments):
    if arguments in (["-h"], ["--help"]):
        print(__doc__.strip())
        return 0
    parser = Parser(prog="plot_capture.py", usage="plot_capture.py RUN [-o PNG]", add_help=False)
    parser.add_argument("run", type=pathlib.Path)
    parser.add_argument("-o", dest="output", type=pathlib.Path)
    options = parser.parse_args(arguments)
    output = options.output or options.run / "capture.png"
    try:
        draw_sheet(CaptureRun(options.run), output)
        return 0
    except InputError as error:
        print(f"plot_capture.py: {error}", file=sys.stderr)
    except OSError as error:
        print(f"plot_capture.py: {output}: cannot be written: {error.strerror or error}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
