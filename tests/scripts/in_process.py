"""Scripts within the test's own process: to load Matplotlib or SciPy takes longer than most tests."""

import contextlib
import io
import subprocess


def run_main(main, *arguments):
    """What a process would give that calls `main`: a subprocess.CompletedProcess with texts."""
    out, messages = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(messages):
        try:
            status = main(list(map(str, arguments)))
        except SystemExit as end:
            status = end.code
    return subprocess.CompletedProcess([], status, out.getvalue(), messages.getvalue())
