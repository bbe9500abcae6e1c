"""Mistakes: the few things that people get wrong when they mount and configure wheels.

Windows that disagree are solved again under each of them (`what_if`), their chi-squared say what
speaks for and against a mounting (`evidence`), and of one pair is remembered what several windows
came to (`mounting_search`).
"""
