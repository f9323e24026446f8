"""Which version of the program each step was measured with: experiments/measured/versions.csv."""

import datetime
import pathlib
import subprocess
from dataclasses import astuple, dataclass, fields

from reproduction.measure import ROOT
from reproduction.tables import read_rows, write_rows

from .steps import SOURCES

FILE = ROOT / "experiments/measured/versions.csv"


@dataclass(frozen=True)
class Record:
    step: str
    version: str  # of the last commit that changed a source; with a + behind it where there were others, not committed
    date: str
    minutes: str
    processor: str


def _git(*arguments):
    return subprocess.run(["git", "-C", str(ROOT), *arguments], capture_output=True, text=True, check=True).stdout.strip()


def version(programs=()):
    """Of a step that runs these programs."""
    sources = (*SOURCES, *programs)
    changed = _git("status", "--porcelain", "--", *sources)
    return _git("log", "-1", "--format=%h", "--", *sources) + ("+" if changed else "")


def processor():
    lines = pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return f"{len(names)} x {names[0]}" if names else "unknown"


def load():
    """By step."""
    return {row["step"]: Record(**row) for row in read_rows(FILE)} if FILE.exists() else {}


def keep(step, programs, seconds):
    records = load()
    today = datetime.date.today().isoformat()
    records[step] = Record(step, version(programs), today, f"{seconds / 60:.1f}", processor())
    write_rows(FILE, [f.name for f in fields(Record)], [astuple(record) for record in records.values()])
