"""Writes a page about a run, also of one that is still going, or a comparison of several.

usage: python3 -m isochron.report DIR... [-o FILE]

  DIR      folder of a run
  -o FILE  default: DIR/report.html; of several runs comparison.html in the current folder
"""

import pathlib
import sys

from isochron.command_line import Parser
from isochron.files import replacing
from isochron.report.comparison import comparison_page
from isochron.report.page import run_page
from isochron.report.run import NoRun, Run


def main(arguments):
    if arguments in (["-h"], ["--help"]):
        print(__doc__.strip())
        return 0
    parser = Parser(prog="report", usage="python3 -m isochron.report DIR... [-o FILE]", add_help=False)
    parser.add_argument("folders", nargs="+")
    parser.add_argument("-o", "--output", type=pathlib.Path)
    options = parser.parse_args(arguments)
    single = len(options.folders) == 1
    usual = pathlib.Path(options.folders[0]) / "report.html" if single else pathlib.Path("comparison.html")
    output = options.output or usual
    try:
        runs = [Run(folder) for folder in options.folders]
        page = run_page(runs[0]) if single else comparison_page(runs)
        with replacing(output) as temporary:
            temporary.write_text(page, encoding="utf-8")
    except NoRun as error:
        print(f"report: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"report: {output}: cannot be written: {error.strerror or error}", file=sys.stderr)
        return 2
    print(output, file=sys.stderr)  # where the program that calls it listens
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
