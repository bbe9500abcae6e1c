"""The pose where it is used: how honest, how fresh and how dear it is (`python -m lab.near`)."""
