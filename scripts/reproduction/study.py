"""The command line of studies that make captures one after the other and measure something on each."""

import pathlib
import tempfile

from reproduction.measure import ROOT
from reproduction.tables import read_rows, write_rows


def study(parser, file, columns, rows_of_captures, table_of):
    """Adds --output and --table to what `parser` has. rows_of_captures(options, folder): for each capture its rows, for a table of that
    name, which is written after every capture; in the folder it may write, that of --keep where there is such an option. table_of(rows):
    the table of a page."""
    parser.add_argument("--output", type=pathlib.Path, default=ROOT / "experiments/measured", help="default: experiments/measured")
    parser.add_argument("--table", action="store_true", help="print the table of what was measured before, as a page has it")
    options = parser.parse_args()
    if options.table:
        print(table_of(read_rows(options.output / file)))
        return 0
    table = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = getattr(options, "keep", None) or pathlib.Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for rows in rows_of_captures(options, folder):
            for row in rows:
                table.append(row)
                print(*row, flush=True)
            write_rows(options.output / file, columns, table)
    return 0
