"""The command `flowborne`.

Exit codes: 1 if a run blew up, was stopped by an error or could not be written, 2 for wrong input,
3 for a complete run with doubtful results and for `check --strict` with warnings, 130 after an
interruption. Each error is one message on stderr.
"""

from __future__ import annotations

import logging
import os
import sys
import warnings
from collections.abc import Sequence

import typer

from flowborne.base.errors import SceneError, fault_of
from flowborne.cli import look, make, take_away, trust  # noqa: F401 (they add their commands)
from flowborne.cli.app import FAILED, INTERRUPTED, WRONG, InputError, StoppedError, app, log
from flowborne.cli.console import complain, sentence_of
from flowborne.runs.run_folder import RunFolderError

BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Our solves are small: more threads in BLAS are slower, and their sums differ."""

UsageError: type[Exception] = typer.BadParameter.__mro__[1]
"""What typer raises when the command line itself is wrong."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line, then leave with its exit code."""
    for name in BLAS_THREADS:
        os.environ[name] = "1"
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # of libraries; errors have their own messages
    logging.getLogger().addHandler(logging.NullHandler())  # what libraries log is not for stderr
    given = list(sys.argv[1:] if arguments is None else arguments)
    try:
        code = app(given or ["--help"], prog_name="flowborne", standalone_mode=False)
    except UsageError as error:
        command = getattr(getattr(error, "ctx", None), "command_path", "flowborne")
        complain(f"{sentence_of(error)}; see {command} --help")
        code = WRONG
    except (InputError, RunFolderError, SceneError) as error:
        for problem in getattr(error, "problems", [str(error)]):
            complain(problem)
        code = WRONG
    except (StoppedError, KeyboardInterrupt, typer.Abort) as stop:
        complain(str(stop) or "interrupted")
        code = INTERRUPTED
    except MemoryError as error:
        complain(
            f"the memory of this machine is full ({error}). Make the grid coarser by [domain] "
            "resolution or cells, or the files smaller"
        )
        code = WRONG
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = FAILED
    except Exception as error:
        log.debug("the error", exc_info=error)
        complain("; ".join([fault_of(error), *getattr(error, "__notes__", ())]))
        code = FAILED
    sys.exit(code if isinstance(code, int) else 0)
