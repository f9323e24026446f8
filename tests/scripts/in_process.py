"""Scripts within the test's own process: to load Matplotlib or SciPy takes longer than most tests."""

import contextlib
import io
import runpy
import subprocess
import sys
import unittest.mock


def run_main(main, *arguments):
    """What a process would give that calls `main`: a subprocess.CompletedProcess with texts."""
    out, messages = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(messages):
        try:
            status = main(list(map(str, arguments)))
        except SystemExit as end:
            status = end.code
    return subprocess.CompletedProcess([], status, out.getvalue(), messages.getvalue())


def run_script(script, *arguments):
    """The same of a script. Its folder has to be in sys.path."""
    def main(words):
        with unittest.mock.patch.object(sys, "argv", [str(script), *words]):
            runpy.run_path(str(script), run_name="__main__")

    return run_main(main, *arguments)
