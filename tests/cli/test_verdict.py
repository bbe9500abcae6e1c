"""From findings to lines, to a verdict and to an exit code."""

from __future__ import annotations

import pytest

from drslamd.cli.verdict import as_table, exit_code, lines, verdict
from drslamd.machine.finding import Finding, Severity

ERROR = Finding("team key", Severity.ERROR, "no key", "make one")
WARNING = Finding("uwb port", Severity.WARNING, "no port", "plug it in", since_s=7)
SECOND = Finding("second daemon", Severity.ERROR, "one runs")


@pytest.mark.parametrize(
    ("findings", "code", "said"),
    [
        ([], 0, "nothing is wrong, run starts"),
        ([WARNING], 0, "run starts, and waits or goes without (one warning)"),
        ([WARNING, WARNING], 0, "run starts, and waits or goes without (2 warnings)"),
        ([ERROR, WARNING], 78, "run refuses to start, exit code 78"),
        ([SECOND, ERROR], 75, "run refuses to start, exit code 75"),
    ],
)
def test_the_verdict_and_the_exit_code_are_those_of_a_run(
    findings: list[Finding], code: int, said: str
) -> None:
    assert exit_code(findings) == code
    assert verdict(findings) == f"verdict: {said}"


def test_a_line_names_the_file_and_a_warning_is_called_one() -> None:
    assert lines("3.toml", [ERROR, WARNING, SECOND]) == [
        "3.toml: no key; make one",
        "3.toml: warning: no port; plug it in",
        "3.toml: one runs",
    ]


def test_a_table_says_since_when_where_that_is_known() -> None:
    error, warning = as_table([ERROR, WARNING])
    assert error == {
        "check": "team key",
        "severity": "error",
        "cause": "no key",
        "remedy": "make one",
    }
    assert warning["since_s"] == 7
