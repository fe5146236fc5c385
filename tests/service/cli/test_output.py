"""Progress goes to a terminal on stderr and nowhere else."""

import io

from rich.console import Console

from service.cli.output import progress_bar, share_text


def test_progress_is_drawn_on_a_terminal():
    terminal = io.StringIO()
    with progress_bar("Sight lines", Console(file=terminal, force_terminal=True, width=80)) as progress:
        for share in (0.25, 0.5, 1.0):
            progress(share)
    drawn = terminal.getvalue()
    assert "Sight lines" in drawn
    assert "100 %" in drawn


def test_progress_is_silent_where_nobody_watches():
    pipe = io.StringIO()
    with progress_bar("Sight lines", Console(file=pipe, force_terminal=False)) as progress:
        progress(0.5)
    assert pipe.getvalue() == ""


def test_a_share_of_nothing_is_a_dash():
    assert (share_text(None), share_text(0.1234)) == ("–", "12.3 %")
