"""Findings for people: one line each, the cause first, and the exit code that follows from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from drslamd.cli.exit_codes import ALREADY_RUNS, BAD_CONFIG, OK
from drslamd.machine.finding import Finding, Severity
from drslamd.machine.refusals import SECOND_DAEMON


def exit_code(findings: Sequence[Finding]) -> int:
    """What ``drslamd run`` ends with before it begins; 0 when it begins."""
    errors = [finding for finding in findings if finding.severity is Severity.ERROR]
    if not errors:
        return OK
    return ALREADY_RUNS if errors[0].check == SECOND_DAEMON else BAD_CONFIG


def lines(config_path: str, findings: Sequence[Finding]) -> list[str]:
    """A line for each."""
    return [
        f"{config_path}: {'' if f.severity is Severity.ERROR else 'warning: '}{f.sentence}"
        for f in findings
    ]


def verdict(findings: Sequence[Finding]) -> str:
    """Would it run?"""
    errors = sum(finding.severity is Severity.ERROR for finding in findings)
    warnings = len(findings) - errors
    if errors:
        return f"verdict: run refuses to start, exit code {exit_code(findings)}"
    if warnings:
        return f"verdict: run starts, and waits or goes without ({_counted(warnings)})"
    return "verdict: nothing is wrong, run starts"


def as_table(findings: Sequence[Finding]) -> list[dict[str, Any]]:
    """For JSON."""
    return [
        {
            "check": finding.check,
            "severity": finding.severity.value,
            "cause": finding.cause,
            "remedy": finding.remedy,
            **({} if finding.since_s is None else {"since_s": finding.since_s}),
        }
        for finding in findings
    ]


def _counted(warnings: int) -> str:
    return "one warning" if warnings == 1 else f"{warnings} warnings"
