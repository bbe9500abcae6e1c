"""The verbs ``init`` and ``calibrate``, made of questions, choices, steps and files."""
